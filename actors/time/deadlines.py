"""Timeouts for many waiting futures at the price of one.

Calls mostly use the same few timeouts, and for one value the deadlines come in order: a queue for each value and one loop timer for
its head are enough. A call that is answered in time costs an append here and its share of a sweep; `asyncio.timeout` would cost
more than the call itself.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from itertools import chain, islice
from typing import Any, Protocol

from actors.checks import is_number

__all__ = ["Deadlines", "Waiting", "check_timeout"]

FEW = 64
"""The number of answered calls that may stay in a queue besides those that wait, and the number looked at in search of a cycle."""


class Waiting(Protocol):
    """Something that waits for its future."""

    future: asyncio.Future[Any]
    due: float
    """Loop time at which it has waited long enough."""

    def late(self) -> BaseException:
        """The error for its future."""
        ...


class _Queue:
    """All that waits with one and the same timeout, in the order of its deadlines."""

    __slots__ = ("full", "timer", "waiting")

    def __init__(self, timer: asyncio.TimerHandle) -> None:
        self.waiting: deque[Waiting] = deque()
        self.full = FEW
        self.timer = timer

    def sweep(self) -> None:
        """Drop what has been answered. As the queue may grow to twice of what is left, this costs little for each call."""
        left = [each for each in self.waiting if not each.future.done()]
        self.waiting.clear()
        self.waiting.extend(left)
        self.full = 2 * len(left) + FEW


class Deadlines:
    """Fails futures that are not done in time."""

    __slots__ = ("_loop", "_queues", "_time")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._time = loop.time
        self._queues: dict[float, _Queue] = {}

    def watch(self, one: Waiting, timeout: float) -> None:
        """Set the exception `one.late()` on `one.future` unless it is done within `timeout` seconds (> 0)."""
        queue = self._queues.get(timeout)
        if queue is None:
            queue = self._opened(timeout)
        one.due = self._time() + timeout
        waiting = queue.waiting
        waiting.append(one)
        if len(waiting) > queue.full:
            queue.sweep()

    def waiting(self, limit: int = FEW) -> list[Waiting]:
        """The calls that still wait, in no particular order, among the first `limit` of all."""
        everything = chain.from_iterable(queue.waiting for queue in self._queues.values())
        return [one for one in islice(everything, limit) if not one.future.done()]

    def close(self) -> None:
        """Forget everything; the futures are left to their owners."""
        for queue in self._queues.values():
            queue.timer.cancel()
        self._queues.clear()

    def _opened(self, timeout: float) -> _Queue:
        if not isinstance(timeout, (int, float)) or math.isnan(timeout):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ValueError(f"timeout={timeout!r}: every call has a limit, a number of seconds")
        queue = self._queues[timeout] = _Queue(self._timer(timeout, self._time() + timeout))
        return queue

    def _timer(self, timeout: float, due: float) -> asyncio.TimerHandle:
        return self._loop.call_at(due, self._expire, timeout)

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
    """Refuse, with a ValueError that begins with `what`, a timeout that is no number of seconds; a NaN would upset the event loop."""
    if not is_number(timeout):
        raise ValueError(f"{what}: timeout={timeout!r:.40} must be a number of seconds, or math.inf for no limit")
