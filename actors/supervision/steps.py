"""Steps: the stops and starts of a supervisor that must be done in order, one child at a time. A serial work queue."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable

from actors.supervision.entry import Entry

__all__ = ["Steps"]


class Steps:
    """Stops, last child first; then, unless something holds them back, starts, first child first.

    Invariants:
    - At most one step is under way: that of `current`. The next one is given out when `current` is None.
    - No start is given out while a stop waits, nor while `hold` lasts, the timer of the backoff that `holder` waits for.
    - `queued` is true of exactly the entries in `starts`, which lie in start order.
    - An entry whose `marked` (stops) or `intent` (starts) was cleared meanwhile is skipped when its turn comes.
    """

    __slots__ = ("current", "hold", "holder", "starts", "stops")

    def __init__(self) -> None:
        self.stops: list[Entry] = []
        self.starts: deque[Entry] = deque()
        self.current: Entry | None = None
        self.hold: asyncio.TimerHandle | None = None
        self.holder: Entry | None = None

    @property
    def busy(self) -> bool:
        """Whether ordered work is under way, so that a start has to take its place in it."""
        return bool(self.current or self.stops or self.starts or self.hold)

    def plan(self, entries: Iterable[Entry]) -> None:
        """Take up everything that is marked, or due, among `entries` (in start order)."""
        self.stops.clear()
        self.starts.clear()
        for entry in entries:
            entry.queued = bool(entry.intent)
            if entry.queued:
                self.starts.append(entry)
            if entry.marked:
                self.stops.append(entry)
        if self.current is not None and self.current.marked:
            self.current = None

    def add(self, entry: Entry) -> None:
        """One more start, in its place in the order."""
        starts = self.starts
        starts.append(entry)
        entry.queued = True
        if len(starts) > 1 and starts[-2].position > entry.position:
            self.starts = deque(sorted(starts, key=lambda each: each.position))

    def next_stop(self) -> Entry | None:
        """Begin the next stop, and say whose it is."""
        while self.stops:
            entry = self.stops.pop()
            if entry.marked:
                self.current = entry
                return entry
        return None

    def next_start(self) -> Entry | None:
        """Begin the next start, and say whose it is."""
        while self.starts and self.hold is None:
            entry = self.starts.popleft()
            entry.queued = False
            if entry.intent and entry.now is None and entry.timer is None:
                self.current = entry
                return entry
        return None

    def hold_for(self, entry: Entry, until: asyncio.TimerHandle) -> None:
        """Let no start happen before `until`, nor before an earlier hold ends."""
        if self.hold is not None:
            if self.hold.when() >= until.when():
                until.cancel()
                return
            self.hold.cancel()
        self.hold, self.holder = until, entry

    def release(self) -> None:
        """End the hold."""
        if self.hold is not None:
            self.hold.cancel()
        self.hold = self.holder = None

    def clear(self) -> None:
        """Give up all that is planned."""
        self.release()
        for entry in self.starts:
            entry.queued = False
        self.stops.clear()
        self.starts.clear()
        self.current = None
