"""The event loop of a replay: its time is what the tape says."""

from __future__ import annotations

import asyncio
from time import monotonic
from typing import Any

__all__ = ["TapeLoop"]


class TapeLoop(asyncio.SelectorEventLoop):
    """An event loop whose `time()` is `now`, seconds, which the driver of a replay sets; after `release` it goes on by itself.

    `virtual` and `epoch`, the time of day at the start of the recorded system, are read by its clock; with `virtual`, its nodes wait as on a
    virtual loop.
    """

    def __init__(self, now: float, epoch: float, virtual: bool) -> None:
        self.now = now
        self.epoch = epoch
        self.virtual = virtual
        self._released: float | None = None
        super().__init__()
        if virtual:
            self.sleep_until: Any = None  # it is there for the clock, which then uses that of the seam

    def time(self) -> float:
        return self.now if self._released is None else self.now + monotonic() - self._released

    def release(self) -> None:
        """Let time pass, because the replay is over."""
        self._released = monotonic()
