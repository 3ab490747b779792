"""When within its period a reader comes for its samples: learned from its first ticks, so that each sample can be ready just before."""

from __future__ import annotations

from typing import Final

LEAD: Final = 0.0015
"""Seconds by which a sample is taken before its reader is due: for the body to compute it, and to be a little late."""
TICKS: Final = 40
"""So many ticks are looked at. Some are late, none is early: the earliest counts."""


class Phase:
    """One reader at `hz` ticks a second."""

    def __init__(self, hz: float) -> None:
        self.hz = hz
        self._first: float | None = None
        self._last = 0.0
        self._earliest = 0.0
        self._ticks = 0

    def tick(self, now: float) -> float | None:
        """The reader comes, at `now`. After the last tick that is looked at: an instant from which samples suit it."""
        period = 1.0 / self.hz
        if self._first is None:
            self._first = self._last = now
            return None
        if now - self._last < 0.5 * period:
            return None  # the same tick, that reads on
        self._last, self._ticks = now, self._ticks + 1
        off = (now - self._first + 0.5 * period) % period - 0.5 * period
        self._earliest = min(self._earliest, off)
        if self._ticks < TICKS:
            return None
        begin = self._first + self._earliest - LEAD
        return begin + (int((now - begin) / period) + 2) * period
