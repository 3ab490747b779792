"""Harnesses of many trials: how many there are, and how the one that failed is run alone.

A trial is made of its number and nothing else. `ROBACTOR_TRIALS` says how many are run, instead of the harness's own number, which takes some
seconds; `ROBACTOR_SEED` names the only one.
"""

from __future__ import annotations

import asyncio
import os
import traceback
from collections.abc import Callable, Coroutine
from typing import Any

from actors.time.virtual_loop import VirtualLoop

MOST_FAILURES = 5
"""After so many trials that failed, the others say nothing new."""


def numbers(usual: int) -> range:
    """The numbers of the trials to run."""
    if (seed := os.environ.get("ROBACTOR_SEED")) is not None:
        return range(int(seed), int(seed) + 1)
    return range(int(os.environ.get("ROBACTOR_TRIALS", usual)))


def check_trials(test: str, trial: Callable[[int], tuple[str, list[str]]], usual: int) -> None:
    """Run `usual` trials, each of which gives its description and what was wrong; fail if anything was."""
    failed: list[str] = []
    for seed in numbers(usual):
        described, problems = trial(seed)
        if problems:
            failed.append("\n    ".join([f"ROBACTOR_SEED={seed} pytest -k {test}   # {described}", *problems]))
        if len(failed) == MOST_FAILURES:
            break
    assert not failed, f"{len(failed)} trials failed; each can be run alone:\n" + "\n".join(failed)


def in_loop(loop: VirtualLoop, story: Coroutine[Any, Any, list[str]]) -> list[str]:
    """Run a story that gives what was wrong, on `loop`; so is what it raises, and what the loop's exception handler is told."""
    told: list[str] = []

    def tell(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        told.append(f"the loop was told: {context.get('message')}: {context.get('exception')!r}")

    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        loop.set_exception_handler(tell)
        try:
            return [*runner.run(story), *told]
        except (Exception, asyncio.CancelledError, SystemExit, KeyboardInterrupt) as error:
            places = traceback.extract_tb(error.__traceback__)
            where = next(
                (f"{place.name}:{place.lineno}" for place in reversed(places) if "tests" in place.filename), ""
            )
            return [f"the loop was left by {error!r} {where}".rstrip(), *told]
