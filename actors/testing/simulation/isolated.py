"""Trials in copies of this process: what one leaves in modules and globals, or in a tree that is a value, no other one sees.

So a trial of a search does exactly what it does again when it is replayed alone, also in a system that keeps its state where it
should not. And whatever a trial does to its process (it exits, it is killed, it never gives the loop its turn back) ends that copy only.
"""

# pyright: reportPrivateUsage=false
# Whether the loop gets on is seen from another thread, without disturbing it: its counters say so; `sys._current_frames` is documented.
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
from typing import TYPE_CHECKING, Any, TypeVar, cast

from actors.places import line_of
from actors.testing.faults import Profile
from actors.testing.simulation.trial import Outcome, Scenario, Trial

if TYPE_CHECKING:
    from actors.system import System
    from actors.time.virtual_loop import VirtualLoop

__all__ = ["BLOCKED_SECONDS", "ENDLESS", "Elsewhere", "Isolated", "in_a_copy"]

T = TypeVar("T")

ENDLESS = ("Blocked", "ProcessEnded")
"""The kinds of failures, as in `Outcome.signature`, after which a trial cannot say anything itself."""
BLOCKED_SECONDS = 20.0
"""Seconds of the processor that one callback may take before the loop is taken to be blocked for ever."""
STARVED = 10.0
"""The factor by which real time may exceed the processor time: a step may wait for something, or the machine may be busy."""


class Elsewhere(Exception):
    """An error in another process: the text of it is this one's, and `report` is its traceback."""

    def __init__(self, text: str, report: str) -> None:
        super().__init__(text, report)
        self.report = report

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, slots=True)
class Isolated:
    """A scenario each trial of which runs in a copy of this process; where processes cannot be copied, in this one."""

    scenario: Scenario
    quiet: bool = True
    """Whether what it prints is left out."""

    def play(self, trial: Trial) -> Outcome:
        """As `Scenario.play` does. The error of the outcome is an `Elsewhere`."""

        def work(answer: Callable[[Outcome], object]) -> None:
            self.play_here(trial, answer)

        try:
            return in_a_copy(work, quiet=self.quiet)
        except EOFError as error:
            return _broken(trial, "ProcessEnded", str(error))

    def play_here(self, trial: Trial, answer: Callable[[Outcome], object]) -> None:
        """Run it in this process, and answer with an outcome that can be sent; with `Blocked` if the loop does not come to its end."""
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
    """Have a copy of this process do `work`, and return what that answers with (picklable). Raises `EOFError` if it ends without an answer.

    Where processes cannot be copied, this one does it.
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
    """The work of the copied process. The keyboard interrupt is left to the original, which receives it as well."""
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
    """A thread that tells when one callback of the loop does not end: no iteration ends, and the loop does not wait for input."""

    def __init__(self, tell: Callable[[str], object]) -> None:
        self._tell = tell
        self._over = threading.Event()
        self._main = threading.get_ident()
        self._loop: VirtualLoop | None = None
        self._thread = threading.Thread(target=self._watch, name="trial guard", daemon=True)
        self._thread.start()  # before the trial begins: whatever thread begins later, and does not end, is a leak

    def attach(self, system: System) -> None:
        """From now on, the loop of this system."""
        self._loop = cast("VirtualLoop", system.loop)

    def end(self) -> None:
        """Watch no more."""
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
                os._exit(1)  # from a thread there is no other way to end what does not end


def progress(loop: VirtualLoop | None, thread: int) -> object:
    """A value that changes with every iteration of a loop in this thread; None while the loop waits for input, or does not run yet."""
    frame = sys._current_frames().get(thread)
    if loop is None or frame is None or frame.f_code.co_filename == selectors.__file__:
        return None
    return loop.progress
