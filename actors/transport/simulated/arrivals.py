"""When messages arrive: any number of them on one timer of the loop."""

from __future__ import annotations

import asyncio
import math
from heapq import heappop, heappush
from typing import Protocol


class Arriving(Protocol):
    """Something that is on its way."""

    def arrive(self) -> None: ...


class Arrivals:
    """All messages on their way in one network.

    Invariants: `arrive` is called from the loop only, in the order of the times, and in the order of `add` for equal times; never before
    its time. While anything is on its way, one timer of the loop is armed for the first of it, and no other.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._heap: list[tuple[float, int, Arriving]] = []
        self._order = 0
        self._armed = math.inf
        self._timer: asyncio.TimerHandle | None = None

    def add(self, at: float, message: Arriving) -> None:
        """Let it arrive at the loop's time `at`."""
        self._order = order = self._order + 1
        heappush(self._heap, (at, order, message))
        if at < self._armed:
            if self._timer is not None:
                self._timer.cancel()
            self._arm(at)

    def _arm(self, at: float) -> None:
        self._armed = at
        self._timer = self._loop.call_at(at, self._fire)

    def _fire(self) -> None:
        heap = self._heap
        now = max(self._armed, self._loop.time())  # a loop may fire a timer a little early, within its resolution
        self._armed, self._timer = now, None  # what is added meanwhile is not earlier: nothing is armed until the end
        try:
            while heap and heap[0][0] <= now:
                heappop(heap)[2].arrive()
        finally:  # an error of a callback goes to the loop, and the rest still arrives
            self._armed = math.inf
            if heap:
                self._arm(heap[0][0])
