"""Many independent trials: in several processes if wanted, and not run again when an earlier command has kept how they went."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar, cast

from cli.command import UsageError
from robot.run.arguments import parse_seed, whole
from tests.figures.measurement import Measurement, Result, add_running

C = TypeVar("C")
T = TypeVar("T")

Outcome: TypeAlias = dict[str, Any]
"""How one trial went, as JSON can hold it."""


def add_trials(
    parser: ArgumentParser, *, quick: str = "a tenth of it", seed: str = "of the first trial; the next have the next"
) -> None:
    """Add --seed, --quick, --jobs and --resume."""
    parser.add_argument("--seed", type=parse_seed, default=1, help=f"{seed} (default 1)")
    parser.add_argument("--quick", action="store_true", help=quick)
    add_running(parser)


class Walked(Protocol):
    """What the outcomes of walks to goals have in common."""

    @property
    def goals(self) -> int: ...

    @property
    def reached(self) -> int: ...

    @property
    def falls(self) -> int: ...

    @property
    def walked(self) -> float: ...


def totals(outcomes: Sequence[Walked]) -> dict[str, Any]:
    """The figures of all walks together, as JSON can hold them: goals, falls, metres, and each outcome."""
    goals, reached = sum(one.goals for one in outcomes), sum(one.reached for one in outcomes)
    return {
        "goals": goals,
        "reached": reached,
        "reached_percent": 100.0 * reached / goals if goals else 0.0,
        "falls": sum(one.falls for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "outcomes": [asdict(cast("Any", one)) for one in outcomes],
    }


def enough(good: int, of: int, percent: float) -> bool:
    """Whether so many per cent are good. One failure is allowed, as it says nothing about a share, unless it leaves none."""
    return of - good <= max(1.0, of * (1.0 - percent / 100.0)) and (good > 0 or of == 0)


def of_trials(
    name: str,
    help: str,
    takes: str,
    *,
    run: Callable[..., T],
    outcome: type[T],
    how: Callable[[Namespace], dict[str, Any]],
    tell: Callable[[T], str],
    summary: Callable[[Sequence[T]], dict[str, Any]],
    show: Callable[[Mapping[str, Any]], str],
    good: Callable[[Mapping[str, Any]], bool],
    arguments: Callable[[ArgumentParser], object],
    many: int,
    quick: str = "a tenth of it",
) -> Measurement:
    """A measurement of `many` trials, or of a tenth of them with --quick, each with a seed of its own.

    `run(seed, **how)` gives the outcome of a trial, a dataclass of the type `outcome`; `how` is what was asked for, as JSON can hold it. `tell` is its line on
    stderr, `summary` the figures of all outcomes, which get `how` beside them for `show` and `good`.
    """

    def all_arguments(parser: ArgumentParser) -> None:
        add_trials(parser, quick=quick)
        parser.add_argument("--trials", type=whole(1, 10000), metavar="N", help=f"how many (default {many})")
        arguments(parser)

    def take(asked: Namespace) -> Result:
        given = how(asked)
        seeds = range(asked.seed, asked.seed + (asked.trials or max(1, many // 10 if asked.quick else many)))
        outcomes: list[T] = []
        what = f"{name} {json.dumps(given, sort_keys=True)}"
        kept = each(partial(_held, run, given), seeds, jobs=asked.jobs, file=asked.resume, what=what)
        with closing(kept) as held:
            for number, one in enumerate(held, start=1):
                outcomes.append(outcome(**one))
                print(f"[{number}/{len(seeds)}] {tell(outcomes[-1])}", file=sys.stderr, flush=True)
        values = {"backend": "physics", "seed": asked.seed, **given, **summary(outcomes)}
        return Result(values, show, good(values))

    return Measurement(name, help, takes, all_arguments, take)


def each(
    run: Callable[[C], Outcome],
    cases: Sequence[C],
    *,
    jobs: int,
    file: Path | None,
    what: str,
    name: Callable[[C], Any] = lambda case: case,
) -> Generator[Outcome]:
    """The outcome of each case, in their order: from `run`, or as `file` has kept it.

    `file` keeps them, a line of JSON each, for the same `what`: a text that says what is run. `name` gives what JSON can hold of a case; no
    two of a command have the same. Raises `UsageError` for a file of something else.
    """
    done = _kept(file, what)
    keys = [json.dumps(name(case)) for case in cases]
    missing = [case for case, key in zip(cases, keys, strict=True) if key not in done]
    with _results(run, missing, jobs) as outcomes:
        for key in keys:
            outcome = done.get(key)
            if outcome is None:
                outcome = next(outcomes)
                if file is not None:
                    with file.open("a", encoding="utf-8") as out:
                        out.write(json.dumps({"what": what, "case": json.loads(key), "outcome": outcome}) + "\n")
            yield outcome


def _held(run: Callable[..., Any], how: Mapping[str, Any], seed: int) -> Outcome:
    """In a process of its own, if wanted."""
    return asdict(run(seed, **how))


def _kept(file: Path | None, what: str) -> dict[str, Outcome]:
    if file is None or not file.exists():
        return {}
    try:
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        return {json.dumps(line["case"]): line["outcome"] for line in lines if line["what"] == what}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise UsageError(
            f"--resume {file}: these are no outcomes of an earlier run: {error}; name another file, or remove this one"
        ) from error


@contextmanager
def _results(run: Callable[[C], Outcome], cases: Sequence[C], jobs: int) -> Generator[Iterator[Outcome]]:
    """The outcomes of cases, in their order: in so many processes, or in this one."""
    if jobs == 1:
        yield map(run, cases)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield pool.map(run, cases)
