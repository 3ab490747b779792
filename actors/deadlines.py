"""Timeouts for many waiting futures at the price of one.

Calls mostly use the same few timeouts, so for each timeout value the deadlines come in order: a queue per value and one loop timer
for its head are enough. A call that is answered in time costs an append here and nothing else; `asyncio.timeout` would cost more
than the call itself.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from typing import Any

__all__ = ["Deadlines"]


class Deadlines:
    """Fails futures that are not done in time."""

    __slots__ = ("_loop", "_queues", "_timers")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._queues: dict[float, deque[tuple[float, asyncio.Future[Any], Callable[[], BaseException]]]] = {}
        self._timers: dict[float, asyncio.TimerHandle] = {}

    def watch(self, future: asyncio.Future[Any], timeout: float, error: Callable[[], BaseException]) -> None:
        """Set the exception that `error()` makes on `future` unless it is done within `timeout` seconds (> 0)."""
        queue = self._queues.get(timeout)
        if queue is None:
            if not isinstance(timeout, (int, float)) or math.isnan(timeout):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise ValueError(f"timeout={timeout!r}: every call has a limit, a number of seconds")
            queue = self._queues[timeout] = deque()
        elif len(queue) > 64:
            while queue and queue[0][1].done():  # keeps the answered calls of a busy second from piling up
                queue.popleft()
        due = self._loop.time() + timeout
        queue.append((due, future, error))
        if timeout not in self._timers:
            self._timers[timeout] = self._loop.call_at(due, self._expire, timeout)

    def close(self) -> None:
        """Forget everything; the futures are left to their owners."""
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()
        self._queues.clear()

    def _expire(self, timeout: float) -> None:
        queue = self._queues[timeout]
        now = self._loop.time()
        while queue and (queue[0][0] <= now or queue[0][1].done()):
            _, future, error = queue.popleft()
            if not future.done():
                future.set_exception(error())
        if queue:
            self._timers[timeout] = self._loop.call_at(queue[0][0], self._expire, timeout)
        else:
            del self._queues[timeout], self._timers[timeout]
