"""The event loop of a replay: its time is what the recording says."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextvars import Context
from time import monotonic
from typing import TypeVarTuple

_Ts = TypeVarTuple("_Ts")


class ReplayLoop(asyncio.SelectorEventLoop):
    """An event loop whose `time()` is `now`, seconds, which the driver of a replay sets; after `release` it goes on by itself.

    Until then timers do nothing. Those of replayed nodes are called by the driver; those of the system around them, such as its ticker, must not
    do what the recording does.

    `virtual` and `epoch`, the time of day at the start of the recorded system, are read by its clock; with `virtual`, its nodes wait as on a
    virtual loop.
    """

    def __init__(self, now: float, epoch: float, virtual: bool) -> None:
        self.now = now
        self.epoch = epoch
        self.virtual = virtual
        self._released: float | None = None
        super().__init__()

    def time(self) -> float:
        return self.now if self._released is None else self.now + monotonic() - self._released

    def call_at(
        self, when: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        if self._released is None:
            return asyncio.TimerHandle(when, callback, args, self, context)
        return super().call_at(when, callback, *args, context=context)

    def release(self) -> None:
        """Let time pass, because the replay is over."""
        self._released = monotonic()
