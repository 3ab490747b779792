"""Trials in copies of this process, so that no trial is affected by what another one has left in modules, globals or the tree.

A trial of a search therefore behaves exactly as it does when it is replayed alone, even if the system keeps state where it should not. A
trial that exits, is killed, or blocks the loop forever ends only its own copy.
"""

# pyright: reportPrivateUsage=false
# Another thread observes the loop's counters to see whether it makes progress, without disturbing it. `sys._current_frames` is documented.
from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import selectors
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any, TypeVar, cast

from actors.places import line_of
from actors.system import System
from actors.testing.faults import Profile
from actors.testing.simulation.trial import Outcome, Scenario, Trial
from actors.time.virtual_loop import VirtualLoop

T = TypeVar("T")

ENDLESS = ("Blocked", "ProcessEnded")
"""The kinds of failures, as in `Outcome.signature`, after which a trial cannot report for itself."""
BLOCKED_SECONDS = 20.0
"""How many seconds of processor time one callback may take before the loop counts as blocked."""
STARVED = 10.0
"""How many times longer a step may take in real time than in processor time: it may wait for something, or the machine may be busy."""


class Elsewhere(Exception):
    """An error raised in another process. It has the text of that error; `report` is its traceback."""

    def __init__(self, text: str, report: str) -> None:
        super().__init__(text, report)
        self.report = report

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, slots=True)
class Isolated:
    """A scenario whose trials run in copies of this process. If processes cannot be copied, they run in this one."""

    scenario: Scenario
    quiet: bool = True
    """Whether the output of the trials is suppressed."""

    def play(self, trial: Trial) -> Outcome:
        """Play a trial as `Scenario.play` does. The error of the outcome is an `Elsewhere`."""

        def work(answer: Callable[[Outcome], object]) -> None:
            self.play_here(trial, answer)

        try:
            return in_a_copy(work, quiet=self.quiet)
        except EOFError as error:
            return _broken(trial, "ProcessEnded", str(error))

    def play_here(self, trial: Trial, answer: Callable[[Outcome], object]) -> None:
        """Play a trial in this process and call `answer` with an outcome that can be pickled: `Blocked` if the loop stops making
        progress."""
        guard = _Guard(lambda text: answer(_broken(trial, "Blocked", text)))
        watched = replace(self.scenario, observers=(*self.scenario.observers, guard.attach))
        try:
            outcome = watched.play(trial)
        finally:
            guard.end()
        error = outcome.error
        if error is not None:
            error = Elsewhere(str(error), "".join(traceback.format_exception(error)))
        answer(replace(outcome, error=error))


def in_a_copy(work: Callable[[Callable[[T], object]], object], *, quiet: bool) -> T:
    """Run `work` in a copy of this process and return what it passes to its argument. Raises `EOFError` if it ends without doing so.

    The value must be picklable. If processes cannot be copied, `work` runs in this one.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        answers: list[T] = []
        work(answers.append)
        return answers[0]
    fork: Any = multiprocessing.get_context("fork")
    inlet, outlet = fork.Pipe(duplex=False)
    process = fork.Process(target=_work, args=(work, outlet, quiet), name="trial")
    process.start()
    outlet.close()
    try:
        answer: T = inlet.recv()
    except EOFError:
        process.join()
        code = process.exitcode
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        raise EOFError(f"the system ended its own process, with {how}") from None
    finally:
        process.kill()
        process.join()
        inlet.close()
    return answer


def _work(work: Callable[[Callable[[T], object]], object], outlet: Connection, quiet: bool) -> None:
    """Do the work of the copied process. It ignores keyboard interrupts, which the original process receives as well."""
    with contextlib.suppress(KeyboardInterrupt):
        if quiet:
            silence = io.StringIO()
            with contextlib.redirect_stdout(silence), contextlib.redirect_stderr(silence):
                work(outlet.send)
        else:
            work(outlet.send)


def _broken(trial: Trial, kind: str, text: str) -> Outcome:
    return Outcome(trial, Elsewhere(text, f"{kind}: {text}\n"), Profile(), "", (kind, ""))


class _Guard:
    """A thread that reports a callback that does not end: no iteration of the loop ends, and the loop does not wait for input."""

    def __init__(self, tell: Callable[[str], object]) -> None:
        self._tell = tell
        self._over = threading.Event()
        self._main = threading.get_ident()
        self._loop: VirtualLoop | None = None
        self._thread = threading.Thread(target=self._watch, name="trial guard", daemon=True)
        self._thread.start()  # started before the trial, so that it is not taken for a leak

    def attach(self, system: System) -> None:
        """Observe the loop of `system` from now on."""
        self._loop = cast("VirtualLoop", system.loop)

    def end(self) -> None:
        """Stop observing, and wait for the thread to end."""
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        seen: object = None
        since, spent = time.monotonic(), time.process_time()
        while not self._over.wait(BLOCKED_SECONDS / 4):
            now = progress(self._loop, self._main)
            if now is None or now != seen:
                seen, since, spent = now, time.monotonic(), time.process_time()
            elif time.process_time() - spent > BLOCKED_SECONDS or time.monotonic() - since > BLOCKED_SECONDS * STARVED:
                self._tell(
                    f"one step keeps the loop and does not end, at {line_of(self._main)}: let time pass in every loop, and await "
                    "self.offload(function, ...) what computes or waits for the real world"
                )
                os._exit(1)  # a thread has no other way to end a callback that does not return


def progress(loop: VirtualLoop | None, thread: int) -> object:
    """Return a value that changes with every iteration of a loop in this thread; None while it waits for input or does not run."""
    frame = sys._current_frames().get(thread)
    if loop is None or frame is None or frame.f_code.co_filename == selectors.__file__:
        return None
    return loop.progress
