"""How the body lay in space when a picture was taken: attitudes and heights of the last two seconds."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

import numpy as np

from robot.geometry.vectors import Vector

__all__ = ["AttitudeHistory"]

_KEEP = 100
"""So many are kept: two seconds of odometry."""


class AttitudeHistory:
    """Stamped attitudes (w, x, y, z) and heights (m); the stamps that are kept grow strictly."""

    __slots__ = ("_stamps", "_values")

    def __init__(self) -> None:
        self._stamps: deque[float] = deque(maxlen=_KEEP)
        self._values: deque[Vector] = deque(maxlen=_KEEP)

    def add(self, stamp: float, attitude: Vector, height: float) -> None:
        """Keep those of the instant `stamp`, s; what is not older goes."""
        while self._stamps and self._stamps[-1] >= stamp:
            self._stamps.pop()
            self._values.pop()
        self._stamps.append(stamp)
        self._values.append(np.array([*attitude, height]))

    def at(self, stamp: float) -> tuple[Vector, float] | None:
        """Attitude, of any length, and height of an instant: between two linearly, after the newest the newest; None before the first."""
        stamps, values = self._stamps, self._values
        if not stamps or stamp < stamps[0]:
            return None
        after = bisect_left(stamps, stamp)
        if after == len(stamps):
            value = values[-1]
        elif stamps[after] == stamp:
            value = values[after]
        else:
            share = (stamp - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
            first, last = values[after - 1], values[after]
            # A quaternion and its opposite say the same: the way between two of them is the shorter one.
            turned = np.append(np.full(4, np.copysign(1.0, first[:4] @ last[:4])), 1.0)
            value = first + share * (turned * last - first)
        return value[:4], float(value[4])
