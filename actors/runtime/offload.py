"""Work outside the event loop, and calls into it from other threads."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any

from actors.inbox.boundary import BOUNDARY, asked

if TYPE_CHECKING:
    from anyio import CapacityLimiter

    from actors.time.clock import Clock


class Offload:
    """Runs functions in worker processes or threads, at most one at once for each core.

    On the virtual clock the function runs at once, in the event loop's thread, so that a run is deterministic.

    Invariants: `_limiter` bounds all threads of one system, and is made at the first use of a thread.
    """

    __slots__ = ("_clock", "_limiter")

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._limiter: CapacityLimiter | None = None

    async def run(self, function: Callable[..., Any], arguments: tuple[Any, ...], takes: float, *, thread: bool) -> Any:
        """See `Node.offload`."""
        if self._clock.virtual:
            result = asked(function, *arguments)
            await self._clock.sleep(takes)
            return result
        if (boundary := BOUNDARY.get()) is not None:
            return await boundary.elsewhere("worker", partial(self._away, function, arguments, thread))
        return await self._away(function, arguments, thread)

    async def _away(self, function: Callable[..., Any], arguments: tuple[Any, ...], thread: bool) -> Any:
        if thread:
            from anyio import CapacityLimiter, to_thread

            if self._limiter is None:
                self._limiter = CapacityLimiter(os.cpu_count() or 2)
            return await to_thread.run_sync(function, *arguments, abandon_on_cancel=False, limiter=self._limiter)
        from anyio import to_process

        return await to_process.run_sync(function, *arguments, cancellable=True)


class CallsFromThreads:
    """Has the event loop call functions that other threads submit, in the order in which they were submitted.

    Invariants: while `_waiting` is not empty, exactly one wake-up of the loop is under way, for any number of functions.
    """

    __slots__ = ("_lock", "_loop", "_waiting")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lock = Lock()
        self._waiting: list[Callable[[], object]] = []

    def submit(self, function: Callable[[], object]) -> None:
        """Have the event loop call `function`, which must not raise. May be called from any thread."""
        with self._lock:
            self._waiting.append(function)
            first = len(self._waiting) == 1
        if first:
            self._loop.call_soon_threadsafe(self._drain)

    def _drain(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for function in waiting:
            function()
