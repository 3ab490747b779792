"""`Window`: the sliding window of restart times."""

from __future__ import annotations

from collections import deque

from actors.supervision.policy import Intensity


class Window:
    """The times of the restarts in the last `within` seconds. A restart exactly `within` seconds old still counts.

    Invariants: `times` ascend, loop time in seconds. When a time is added, those more than `within` seconds before it are
    removed.
    """

    __slots__ = ("times",)

    def __init__(self) -> None:
        self.times: deque[float] = deque()

    def full(self, now: float, intensity: Intensity) -> bool:
        """Whether a restart at `now` would be one more than `intensity` allows. This changes nothing."""
        times, allowed = self.times, intensity.restarts
        if len(times) < allowed:
            return False
        return allowed == 0 or _recent(times[-allowed], now, intensity)

    def add(self, now: float, intensity: Intensity) -> None:
        """Count a restart at `now`, and remove those that are too old to count."""
        times = self.times
        times.append(now)
        while not _recent(times[0], now, intensity):
            times.popleft()


def _recent(at: float, now: float, intensity: Intensity) -> bool:
    return round(now - at, 9) <= intensity.within  # deadlines are exact to 1 ns, so ages are rounded to that
