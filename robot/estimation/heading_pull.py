"""Turns odometry's heading to where scans see it, so slowly that odometry never jumps, and finds the gyro's bias by it."""

from __future__ import annotations

from math import inf
from typing import Final

PULL: Final = 0.3
"""Of the heading's error, 1/s."""
LEARN: Final = 0.0225
"""Of the error, into the gyro's bias, 1/s2: a quarter of the square of PULL, so that a step of the bias is taken up without overshooting."""
FASTEST: Final = 0.01
"""The heading is turned no faster than this, rad/s: ten times what a gyro drifts by; chosen."""
FRESH: Final = 0.5
"""A scan's word counts for so long, s; chosen: one of those that come 5 times a second may be missing."""


class HeadingPull:
    """The latest word of the scans on odometry's heading."""

    __slots__ = ("_age", "_error")

    def __init__(self) -> None:
        self._error, self._age = 0.0, inf

    @property
    def active(self) -> bool:
        """Whether scans have told of the heading just now."""
        return self._age < FRESH

    def seen(self, error: float) -> None:
        """Scans see the heading too large by `error`, rad."""
        self._error, self._age = error, 0.0

    def advance(self, dt: float) -> tuple[float, float]:
        """Over the next `dt` seconds: how fast to turn the heading, rad/s, and what the gyro's bias becomes larger by, rad/s."""
        self._age += dt
        if not self.active:
            return 0.0, 0.0
        rate = max(-FASTEST, min(FASTEST, PULL * self._error))
        learned = LEARN / PULL * rate * dt
        self._error -= rate * dt
        return -rate, learned
