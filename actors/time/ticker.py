"""Periodic callbacks: any number of them on one timer of the event loop. `@every` uses it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextvars import copy_context
from heapq import heapify, heappop, heappush, heapreplace
from typing import Protocol, TypeAlias


class Ticking(Protocol):
    """The source of one timer's ticks: a `TickHandle`, or under simulated time a `SimTick`."""

    k: int
    """The number of the last tick."""

    def skip_missed(self) -> int:
        """Drop the ticks that are due and were not delivered. Returns how many there were."""
        ...

    def cancel(self) -> None:
        """End the ticks."""
        ...


class TickSource(Protocol):
    """A `Ticker` or a `SimTicker`."""

    def add(self, hz: float, callback: Callable[[int, float], None], start: float | None = None) -> Ticking: ...


class TickHandle:
    """One periodic callback of a `Ticker`. Tick k is due at `start + k / hz`, so ticks never drift."""

    __slots__ = ("_ticker", "callback", "canceled", "hz", "k", "moved", "order", "start")

    def __init__(
        self, ticker: Ticker, order: int, hz: float, callback: Callable[[int, float], None], start: float
    ) -> None:
        self._ticker = ticker
        self.order = order
        self.hz = hz
        self.callback = callback
        self.start = start
        self.k = 0
        self.canceled = False
        self.moved = False
        """Whether ticks were skipped. Its entry in the ticker's heap is then too early."""

    def __repr__(self) -> str:
        name = getattr(self.callback, "__qualname__", repr(self.callback))
        return f"<TickHandle {name} at {self.hz:g} Hz from {self.start:.6f} s, {self.k} ticks so far>"

    @property
    def missed(self) -> int:
        """The number of further ticks that are due but not delivered: the whole periods that have passed since the last one."""
        return max(0, math.floor((self._ticker.now - self.start) * self.hz + 1e-6) - self.k)

    def skip_missed(self) -> int:
        """Drop the ticks that are due already; the next one is on the grid in the future. Returns their number."""
        missed = self.missed
        if missed:
            self.k += missed
            self.moved = True
        return missed

    def cancel(self) -> None:
        """End the ticks, including those due at this instant. Calling it twice is harmless."""
        self._ticker.remove(self)


_Entry: TypeAlias = tuple[int, int, float, TickHandle]
"""A heap entry: the due time in whole nanoseconds, the order of adding, the exact due time in seconds, the tick."""


class Ticker:
    """Calls any number of periodic synchronous callbacks from one timer of `loop`. Use it only in the loop's thread.

    A callback receives `(k, due)`: the number of the tick, from 1, and the loop time at which it was due. Ticks are delivered in the order
    of their due times; those within the same nanosecond in the order in which they were added. On a busy loop, ticks are delivered late
    rather than dropped, with turns of the loop in between; a callback may skip them (see `TickHandle.missed`). An exception of a callback
    is passed to the loop's exception handler, and the ticks go on. Callbacks run in the context in which the ticker was created.

    On a virtual loop, the ticks of one instant are delivered, then everything that they woke runs, and then time moves on.

    Invariants:

    * Every tick that is not canceled has exactly one entry in the heap.
    * At most half of the entries belong to canceled ticks.
    * The timer is set for the first entry, unless a delivery is under way, which sets it at its end.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._heap: list[_Entry] = []
        self._added = 0
        self._canceled = 0  # canceled ticks in the heap; they are removed when they are due or when they are too many
        self._timer: asyncio.TimerHandle | None = None
        self._armed = math.inf  # the due time, in seconds, for which the timer is set
        self._delivering = False
        self._context = copy_context()
        self._advance_to: Callable[[float], bool] | None = getattr(loop, "advance_to", None)

    @property
    def now(self) -> float:
        """The loop's time, in seconds. Not kept as a bound method: a journal replaces the loop's class later, and notes each reading."""
        return self._loop.time()

    def __repr__(self) -> str:
        return f"<Ticker with {len(self._heap) - self._canceled} periodic callbacks>"

    def add(self, hz: float, callback: Callable[[int, float], None], start: float | None = None) -> TickHandle:
        """Call `callback(k, due)` at `start + k / hz` for k = 1, 2, ...; `start` is a loop time in seconds, by default now.

        `hz` must be above 0 and at most 1 MHz. If `start` is in the past, the ticks that are already due are delivered at once.
        """
        if not 0.0 < hz <= 1e6:
            raise ValueError(f"a tick rate of {hz} Hz is out of range: it must be above 0 and at most 1e6 Hz")
        begin = self._loop.time() if start is None else start
        if not math.isfinite(begin):
            raise ValueError(f"the start of a periodic callback must be a finite loop time in seconds, not {start}")
        self._added += 1
        tick = TickHandle(self, self._added, hz, callback, begin)
        heappush(self._heap, self._entry(tick))
        self._arm()
        return tick

    def remove(self, tick: TickHandle) -> None:
        """Cancel a tick. Does nothing for a tick of another ticker."""
        if tick.canceled or tick._ticker is not self:  # pyright: ignore[reportPrivateUsage]
            return
        tick.canceled = True
        self._canceled += 1
        # Canceled entries never outnumber the others, and no cancellation searches the heap.
        if self._canceled > len(self._heap) // 2:
            self._heap[:] = [entry for entry in self._heap if not entry[3].canceled]
            heapify(self._heap)
            self._canceled = 0
        self._arm()

    def _entry(self, tick: TickHandle) -> _Entry:
        due = tick.start + (tick.k + 1) / tick.hz
        return (int(due * 1e9 + 0.5), tick.order, due, tick)

    def _arm(self) -> None:
        """Set the loop's timer to the first due time. During a delivery, that is done at its end."""
        if self._delivering:
            return
        while self._heap and self._heap[0][3].canceled:
            self._drop_first()
        due = self._heap[0][2] if self._heap else math.inf
        if due == self._armed:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._armed = due
        self._timer = self._loop.call_at(due, self._deliver, context=self._context) if self._heap else None

    def _drop_first(self) -> None:
        heappop(self._heap)
        self._canceled -= 1

    def _deliver(self) -> None:
        """Deliver the ticks that are due; on a virtual loop also later ones, as long as nothing else can run before them."""
        heap, advance_to = self._heap, self._advance_to
        instant = int(max(self._armed, self._loop.time()) * 1e9 + 0.5)  # asyncio may call a nanosecond early
        self._armed, self._timer, self._delivering = math.inf, None, True
        try:
            while heap:
                key, order, due, tick = heap[0]
                if tick.canceled:
                    self._drop_first()
                    continue
                if tick.moved:
                    tick.moved = False
                    heapreplace(heap, self._entry(tick))
                    continue
                if key > instant:
                    if advance_to is None or not advance_to(due):
                        break
                    instant = key
                tick.k = k = tick.k + 1
                following = tick.start + (k + 1) / tick.hz
                following_key = int(following * 1e9 + 0.5)
                heapreplace(heap, (following_key, order, following, tick))
                if following_key <= instant:  # whole periods late: give the loop a turn after each tick
                    instant = key
                try:
                    tick.callback(k, due)
                except Exception as error:
                    message = f"Exception in the periodic callback {tick!r}"
                    self._loop.call_exception_handler({"message": message, "exception": error})
        finally:
            self._delivering = False
            self._arm()
