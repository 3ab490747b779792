"""The event loop of a replay: its time is what the recording says."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextvars import Context
from itertools import islice
from time import monotonic
from typing import TypeVarTuple

from actors.time.deadlines import FEW, Deadlines, Waiting

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


class ReplayDeadlines(Deadlines):
    """The `Deadlines` of a system in which a recording is played. None passes by itself: the recording says which calls were not
    answered in time, and once the nodes have left it, the driver has deadlines pass when they are due.

    `now()` is the time, seconds on the clock of the event loop.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._waiting: list[Waiting] = []

    def watch(self, one: Waiting, timeout: float) -> None:
        """Have `one.future` fail with `one.late()` in `timeout` seconds."""
        one.due = self._now() + timeout
        self._waiting = [other for other in self._waiting if not other.future.done()]
        self._waiting.append(one)

    def waiting(self, limit: int = FEW) -> list[Waiting]:
        """The first `limit` objects that still wait."""
        return list(islice((one for one in self._waiting if not one.future.done()), limit))

    @property
    def due(self) -> float:
        """The next deadline; infinite without one."""
        return min((one.due for one in self._waiting if not one.future.done()), default=math.inf)

    def expire(self) -> None:
        """Let the next deadline pass."""
        late = min((one for one in self._waiting if not one.future.done()), key=lambda one: one.due)
        late.future.set_exception(late.late())

    def close(self) -> None:
        """Drop all."""
        self._waiting.clear()
