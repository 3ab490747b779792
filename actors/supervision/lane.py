"""The lane: the work of a supervisor that must be done in order, one child at a time."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable

from actors.supervision.entry import Entry

__all__ = ["Lane"]


class Lane:
    """Stops, last child first; then, once nothing holds it back, starts, first child first.

    `current` is the child that is being stopped or started. `hold` runs out when the backoff of `holder` does.
    Entries are taken back from the lane by clearing their `marked` or `intent`: they are skipped when their turn comes.
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
        while self.stops:
            entry = self.stops.pop()
            if entry.marked:
                return entry
        return None

    def next_start(self) -> Entry | None:
        while self.starts:
            entry = self.starts.popleft()
            entry.queued = False
            if entry.intent and entry.now is None and entry.timer is None:
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
        self.release()
        self.stops.clear()
        self.starts.clear()
        self.current = None
