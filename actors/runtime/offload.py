"""`Offload`: work outside of the event loop, in worker processes and threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
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

    async def run(
        self, function: Callable[..., object], arguments: tuple[object, ...], takes: float, *, thread: bool
    ) -> Any:
        """See `Node.offload`."""
        if self._clock.virtual:
            result = asked(function, *arguments)
            await self._clock.sleep(takes)
            return result
        if (boundary := BOUNDARY.get()) is not None:
            return await boundary.elsewhere("worker", partial(self._away, function, arguments, thread))
        return await self._away(function, arguments, thread)

    async def _away(self, function: Callable[..., object], arguments: tuple[object, ...], thread: bool) -> object:
        if thread:
            from anyio import CapacityLimiter, to_thread

            if self._limiter is None:
                self._limiter = CapacityLimiter(os.cpu_count() or 2)
            return await to_thread.run_sync(function, *arguments, abandon_on_cancel=False, limiter=self._limiter)
        from anyio import BrokenWorkerProcess, to_process

        try:
            return await to_process.run_sync(function, *arguments, cancellable=True)
        except BrokenWorkerProcess as error:
            if isinstance(error.__cause__, RuntimeError):  # of a main module that starts the program again
                raise error.__cause__ from None
            raise
