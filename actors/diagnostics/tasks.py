"""The two usual tasks: how often something happens, and how old what comes is."""

from __future__ import annotations

from collections import deque

from actors.diagnostics.status import Status
from actors.interfaces.builtin_interfaces.msg import Time
from actors.time.clock import Clock
from actors.time.values import nanoseconds_of


class FrequencyStatus:
    """A task that checks how often `tick` is called: ``updater.add("scan rate", scans)``, and ``scans.tick()`` at each scan.

    The frequency, between `low` and `high` Hz give or take the part `tolerance`, is measured over the last `window` updates. ERROR if
    nothing happens, WARN if it is too low or too high.
    """

    # Invariant: `_marks` holds the time and the number of ticks at the last `window` updates, oldest first; at least one.

    def __init__(
        self, clock: Clock, low: float, high: float | None = None, *, tolerance: float = 0.1, window: int = 5
    ) -> None:
        self._clock = clock
        self._low = low
        self._high = low if high is None else high
        self._tolerance = tolerance
        self._count = 0
        self._marks: deque[tuple[float, int]] = deque([(clock.now(), 0)], maxlen=window)

    def tick(self) -> None:
        """Count one event."""
        self._count += 1

    def __call__(self, status: Status) -> None:
        now, (since, before) = self._clock.now(), self._marks[0]
        self._marks.append((now, self._count))
        events, seconds = self._count - before, now - since
        frequency = events / seconds if seconds > 0 else 0.0
        low, high = self._low * (1 - self._tolerance), self._high * (1 + self._tolerance)
        if not events:
            status.error("No events recorded.")
        elif frequency < low:
            status.warn("Frequency too low.")
        elif frequency > high:
            status.warn("Frequency too high.")
        else:
            status.ok("Desired frequency met")
        status.add("Events in window", events)
        status.add("Events since startup", self._count)
        status.add("Duration of window (s)", seconds)
        status.add("Actual frequency (Hz)", frequency)
        if self._low == self._high:
            status.add("Target frequency (Hz)", float(self._low))
        status.add("Minimum acceptable frequency (Hz)", low)
        status.add("Maximum acceptable frequency (Hz)", high)


class TimeStampStatus:
    """A task that checks the age of stamps: between `low` (negative: from the future) and `high` seconds when `tick` is given them.

    ERROR for a stamp too old, too far in the future or zero since the last update, WARN without any.
    """

    def __init__(self, clock: Clock, low: float = -1.0, high: float = 5.0) -> None:
        self._clock = clock
        self._low, self._high = low, high
        self._youngest: float | None = None
        self._oldest: float | None = None
        self._zero = False
        self._early = self._late = self._zeros = 0

    def tick(self, stamp: Time) -> None:
        """Look at the stamp of what has just come."""
        then = nanoseconds_of(stamp)
        if then == 0:
            self._zero = True
            return
        age = (self._clock.wall_ns() - then) / 1e9
        self._youngest = age if self._youngest is None else min(age, self._youngest)
        self._oldest = age if self._oldest is None else max(age, self._oldest)

    def __call__(self, status: Status) -> None:
        status.ok("Timestamps are reasonable.")
        youngest, oldest = self._youngest, self._oldest
        if youngest is None or oldest is None:
            if not self._zero:
                status.warn("No data since last update.")
        else:
            if youngest < self._low:
                self._early += 1
                status.error("Timestamps too far in future seen.")
            if oldest > self._high:
                self._late += 1
                status.error("Timestamps too far in past seen.")
            status.add("Earliest timestamp delay", youngest)
            status.add("Latest timestamp delay", oldest)
        if self._zero:
            self._zeros += 1
            status.error("Zero timestamp seen.")
        status.add("Earliest acceptable timestamp delay", float(self._low))
        status.add("Latest acceptable timestamp delay", float(self._high))
        status.add("Late diagnostic update count", self._late)
        status.add("Early diagnostic update count", self._early)
        status.add("Zero seen diagnostic update count", self._zeros)
        self._youngest = self._oldest = None
        self._zero = False
