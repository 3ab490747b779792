"""The time of a bag while it is played: it runs at a rate, stands still, and jumps."""

from __future__ import annotations

from typing import Final

MOST_SECONDS: Final = 1e8
"""What is longer, such as a rate of 1e308 makes it, counts as so long: no bag has three years."""


def nanoseconds(seconds: float) -> int:
    """A duration in nanoseconds."""
    return round(min(seconds, MOST_SECONDS) * 1e9)


class PlayClock:
    """Maps the time of a clock that always runs, in seconds, to the time of a bag, in nanoseconds.

    Invariants: at `_anchor`, the bag's time was `_bag_ns`. Since then it has run at `rate`, or stood still while `paused`.
    """

    __slots__ = ("_anchor", "_bag_ns", "paused", "rate")

    def __init__(self, now: float, bag_ns: int, rate: float, *, paused: bool) -> None:
        self._anchor = now
        self._bag_ns = bag_ns
        self.rate = rate
        self.paused = paused

    def bag_ns(self, now: float) -> int:
        """The time of the bag at the instant `now`."""
        if self.paused:
            return self._bag_ns
        return self._bag_ns + nanoseconds((now - self._anchor) * self.rate)

    def instant(self, bag_ns: int) -> float:
        """When the bag's time will be `bag_ns`, if nothing changes and it is not paused."""
        return self._anchor + (bag_ns - self._bag_ns) / 1e9 / self.rate

    def pause(self, now: float) -> None:
        self.seek(now, self.bag_ns(now))
        self.paused = True

    def unpause(self, now: float) -> None:
        self.seek(now, self.bag_ns(now))
        self.paused = False

    def set_rate(self, now: float, rate: float) -> None:
        """Run at another rate from `now` on. Raises `ValueError` if it is not above 0."""
        if not 0 < rate < float("inf"):
            raise ValueError(f"a bag cannot be played at the rate {rate:g}: it must be above 0")
        self.seek(now, self.bag_ns(now))
        self.rate = rate

    def seek(self, now: float, bag_ns: int) -> None:
        """Let the bag's time be `bag_ns` at the instant `now`."""
        self._anchor, self._bag_ns = now, bag_ns
