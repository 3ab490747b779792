"""Calls from other threads into an event loop, many with one wake-up."""

from __future__ import annotations

import time
from asyncio import AbstractEventLoop, TimerHandle
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, TypeVar

from actors.time.real_loop import waking
from actors.transport.protocol import next_look

T = TypeVar("T")

_CALLS: Final = 512
_SECONDS: Final = 0.002
"""The most calls, and about the longest time, within one turn of the loop. Whatever else is ready then has its turn."""


class Wakeup:
    """Makes calls on a loop that other threads ask for, in the order in which they were asked for.

    To wake a loop costs ten times as much as to append to a deque. Therefore the calls wait in a deque, and the loop is woken only if it is
    not about to empty it anyway.

    Calls that may wait do not wake it at all: they are made with the next one that does, when the loop wakes for another reason, by `look`, or
    at regular times from `be_patient` to `cease`.

    Invariants: while a call waits that was asked for by `post`, a turn of the loop that makes it is scheduled; `_timer` runs while `_patient`
    is not empty; after `close` no call is made.
    """

    def __init__(self, loop: AbstractEventLoop) -> None:
        self._loop = loop
        self.time = loop.time
        """The loop's clock, in seconds. From any thread."""
        self.end = 0.0
        """When a call that does many things has to leave the rest to `go_on`, in seconds of `time.perf_counter`."""
        self._waiting: deque[tuple[Callable[[Any], None], object]] = deque()
        self._scheduled = False
        self._closed = False
        self._patient: list[float] = []
        """For how long each patient subscription may wait, seconds."""
        self._timer: TimerHandle | None = None
        self._waking = waking(loop)
        self._waking.append(self._look_soon)

    def post(self, call: Callable[[T], None], argument: T) -> None:
        """Have `call(argument)` made on the loop, soon. From any thread; never waits, never calls at once."""
        self._waiting.append((call, argument))
        if not self._scheduled and not self._closed:
            self._scheduled = True
            with suppress(RuntimeError):  # the loop has been closed: there is nothing to call any more
                self._loop.call_soon_threadsafe(self._make_calls)

    def post_patiently(self, call: Callable[[T], None], argument: T) -> None:
        """Like `post`, but the loop is not woken for it: `look` makes it, or the regular times from `be_patient` to `cease`."""
        self._waiting.append((call, argument))

    def go_on(self, call: Callable[[T], None], argument: T) -> None:
        """Have `call(argument)` made before all calls that wait, in the next turn. To be called from within a call."""
        self.end = 0.0
        self._waiting.appendleft((call, argument))

    def be_patient(self, patience: float) -> None:
        """Look for calls that wait, at the times of `next_look`, until `cease` is called with the same. On the loop's thread."""
        self._patient.append(patience)
        if not self._closed and patience <= min(self._patient):
            self._rest()
            self._timer = self._loop.call_at(next_look(self._loop.time(), patience), self._look)

    def cease(self, patience: float) -> None:
        """Undo `be_patient`."""
        self._patient.remove(patience)
        if not self._patient:
            self._rest()

    def look(self) -> None:
        """Make the calls that wait. On the loop's thread."""
        if self._waiting and not self._scheduled:
            self._make_calls()

    def close(self) -> None:
        """Make no more calls. On the loop's thread."""
        if not self._closed:
            self._waking.remove(self._look_soon)
        self._closed = True
        self._waiting.clear()
        self._rest()

    def _rest(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> None:
        self._timer = self._loop.call_at(next_look(self._loop.time(), min(self._patient)), self._look)
        self.look()

    def _look_soon(self) -> None:
        """The loop has been woken: make the calls that wait first."""
        if self._waiting and not self._scheduled:
            self._scheduled = True
            self._loop.call_soon(self._make_calls)

    def _make_calls(self) -> None:
        # Cleared before the first call is taken: what is appended from here on either is seen below, or wakes the loop again.
        self._scheduled = False
        self.end = time.perf_counter() + _SECONDS
        try:
            for _ in range(_CALLS):
                if self._closed or not self._waiting:
                    return
                call, argument = self._waiting.popleft()
                call(argument)
                if time.perf_counter() > self.end:
                    return
        finally:  # also after a call that raised, which the loop reports
            if self._waiting and not self._closed:
                self._scheduled = True
                self._loop.call_soon(self._make_calls)
