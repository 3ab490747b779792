"""Timeouts for many futures with few timers.

Most calls use one of a few timeouts, and the deadlines of calls with the same timeout come in the order of the calls. So one queue per
timeout, with one loop timer for its first entry, is enough. A call that is answered in time costs an append and its share of a sweep;
`asyncio.timeout` would cost more than the call itself.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextvars import copy_context
from itertools import chain, islice
from typing import Any, Protocol

from actors.checks import is_number

FEW = 64
"""The number of answered calls that a queue may hold in addition to the waiting ones, and the number searched for a cycle."""


class Waiting(Protocol):
    """An object that waits for its future until a deadline."""

    future: asyncio.Future[Any]
    due: float
    """The deadline, in seconds of the loop's time."""

    def late(self) -> BaseException:
        """Build the error for the future after the deadline."""
        ...


class _Queue:
    """The waiting objects with one timeout, in the order of their deadlines."""

    __slots__ = ("full", "timer", "waiting")

    def __init__(self, timer: asyncio.TimerHandle) -> None:
        self.waiting: deque[Waiting] = deque()
        self.full = FEW
        self.timer = timer

    def sweep(self) -> None:
        """Remove the entries that have been answered. A queue may grow to twice the size of what remains, so the cost per call is small."""
        left = [each for each in self.waiting if not each.future.done()]
        self.waiting.clear()
        self.waiting.extend(left)
        self.full = 2 * len(left) + FEW


class Deadlines:
    """Fails futures that are not completed in time.

    Invariants:

    * Each timeout in use has one queue, ordered by deadline, and one loop timer for its first entry.
    * The timers run in the context in which this was made, not in that of the call that happens to be the first of its timeout.
    * An entry whose future is completed is ignored, and removed at the latest when its deadline passes.
    """

    __slots__ = ("_context", "_loop", "_queues", "_time")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._context = copy_context()
        self._time = loop.time
        self._queues: dict[float, _Queue] = {}

    def watch(self, one: Waiting, timeout: float) -> None:
        """Fail `one.future` with `one.late()` if it is not completed within `timeout` seconds. Raises `ValueError` for an invalid
        timeout."""
        queue = self._queues.get(timeout)
        if queue is None:
            queue = self._opened(timeout)
        one.due = self._time() + timeout
        waiting = queue.waiting
        waiting.append(one)
        if len(waiting) > queue.full:
            queue.sweep()

    def waiting(self, limit: int = FEW) -> list[Waiting]:
        """The objects that still wait among the first `limit` entries, in no particular order."""
        everything = chain.from_iterable(queue.waiting for queue in self._queues.values())
        return [one for one in islice(everything, limit) if not one.future.done()]

    def close(self) -> None:
        """Drop all entries. Their futures are left to their owners."""
        for queue in self._queues.values():
            queue.timer.cancel()
        self._queues.clear()

    def _opened(self, timeout: float) -> _Queue:
        check_timeout("a call", timeout)
        queue = self._queues[timeout] = _Queue(self._timer(timeout, self._time() + timeout))
        return queue

    def _timer(self, timeout: float, due: float) -> asyncio.TimerHandle:
        return self._loop.call_at(due, self._expire, timeout, context=self._context)

    def _expire(self, timeout: float) -> None:
        queue = self._queues[timeout]
        waiting = queue.waiting
        now = self._time()
        while waiting and (waiting[0].due <= now or waiting[0].future.done()):
            one = waiting.popleft()
            if not one.future.done():
                one.future.set_exception(one.late())
        if waiting:
            queue.timer = self._timer(timeout, waiting[0].due)
        else:
            del self._queues[timeout]


def check_timeout(what: str, timeout: object) -> None:
    """Raise a `ValueError` that begins with `what` if `timeout` is not a valid number of seconds. A NaN would break the event loop's
    timers."""
    if not is_number(timeout):
        raise ValueError(f"{what}: timeout={timeout!r:.40} must be a number of seconds, or math.inf for no limit")
