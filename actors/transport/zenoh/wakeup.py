"""Calls from other threads into an event loop, many with one wake-up."""

from __future__ import annotations

import time
from asyncio import AbstractEventLoop
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

__all__ = ["Wakeup"]

_CALLS: Final = 512
_SECONDS: Final = 0.002
"""The most calls, and about the longest time, within one turn of the loop. Whatever else is ready then has its turn."""


class Wakeup:
    """Makes calls on a loop that other threads ask for, in the order in which they were asked for.

    To wake a loop costs ten times as much as to append to a deque. Therefore the calls wait in a deque, and the loop is woken only if it is
    not about to empty it anyway.

    Invariants: while a call waits, a turn of the loop that makes it is scheduled; after `close` no call is made.
    """

    def __init__(self, loop: AbstractEventLoop) -> None:
        self._loop = loop
        self._waiting: deque[tuple[Callable[[Any], None], Any]] = deque()
        self._scheduled = False
        self._closed = False

    def post(self, call: Callable[[Any], None], argument: Any) -> None:
        """Have `call(argument)` made on the loop, soon. From any thread; never waits, never calls at once."""
        self._waiting.append((call, argument))
        if not self._scheduled and not self._closed:
            self._scheduled = True
            with suppress(RuntimeError):  # the loop has been closed: nobody is left to be called
                self._loop.call_soon_threadsafe(self._make_calls)

    def close(self) -> None:
        """Make no more calls. On the loop's thread."""
        self._closed = True
        self._waiting.clear()

    def _make_calls(self) -> None:
        # Cleared before the first call is taken: what is appended from here on either is seen below, or wakes the loop again.
        self._scheduled = False
        end = time.perf_counter() + _SECONDS
        try:
            for _ in range(_CALLS):
                if self._closed or not self._waiting:
                    return
                call, argument = self._waiting.popleft()
                call(argument)
                if time.perf_counter() > end:
                    return
        finally:  # also after a call that raised, which the loop reports
            if self._waiting and not self._closed:
                self._scheduled = True
                self._loop.call_soon(self._make_calls)
