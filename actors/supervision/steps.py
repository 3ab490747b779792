"""`Steps`: the ordered stops and starts of a supervisor, which are done one child at a time."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable

from actors.supervision.entry import Entry


class Steps:
    """A queue of stops, the last child first, and of starts, the first child first. All stops come before the starts.

    Invariants:

    - At most one step is under way, that of `current`. The next one begins when `current` is None.
    - No start begins while a stop waits, or while the timer `hold` runs, which is that of the backoff of `holder`.
    - `queued` is true for exactly the entries in `starts`, which are in start order.
    - An entry whose `marked` (for a stop) or `intent` (for a start) was cleared meanwhile is skipped when its turn comes.
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
        """Replace the queue by the stops of all marked entries and the starts of all due ones. `entries` are in start order."""
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
        """Add a start, in its place in the order."""
        starts = self.starts
        starts.append(entry)
        entry.queued = True
        if len(starts) > 1 and starts[-2].position > entry.position:
            self.starts = deque(sorted(starts, key=lambda each: each.position))

    def next_stop(self) -> Entry | None:
        """Begin the next stop, and return its entry; None if no stop is left."""
        while self.stops:
            entry = self.stops.pop()
            if entry.marked:
                self.current = entry
                return entry
        return None

    def next_start(self) -> Entry | None:
        """Begin the next start, and return its entry; None if no start is left, or starts are held back."""
        while self.starts and self.hold is None:
            entry = self.starts.popleft()
            entry.queued = False
            if entry.intent and entry.now is None and entry.timer is None:
                self.current = entry
                return entry
        return None

    def hold_for(self, entry: Entry, until: asyncio.TimerHandle) -> None:
        """Hold back all starts until the timer `until` fires, or until that of an earlier hold does if that is later."""
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
        """Drop all stops, all starts and the hold."""
        self.release()
        for entry in self.starts:
            entry.queued = False
        self.stops.clear()
        self.starts.clear()
        self.current = None
