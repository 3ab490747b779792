"""The sliding window of restart times."""

from __future__ import annotations

from collections import deque

from actors.supervision.policy import Intensity

__all__ = ["Window"]


class Window:
    """The restarts of the last `within` seconds. A restart exactly `within` seconds old still counts."""

    __slots__ = ("times",)

    def __init__(self) -> None:
        self.times: deque[float] = deque()

    def add(self, now: float, intensity: Intensity) -> bool:
        """Count a restart at `now` (seconds); whether it is still within `intensity`."""
        times = self.times
        times.append(now)
        while round(now - times[0], 9) > intensity.within:  # deadlines are exact to 1 ns, so ages are, too
            times.popleft()
        return len(times) <= intensity.restarts
