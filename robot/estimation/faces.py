"""The faces that a scan shows: for each beam the straight piece of wall that it and its neighbours have met, as a line with a normal.

A line through the ends of nine beams is surer than one end by a factor of three, and knows which way it looks.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns

BESIDE: Final = 4
"""A face is fitted through the ends of so many beams on each side."""
FEWEST: Final = 5
"""Of the beams of one fit that have met the same thing."""
SAME: Final = 0.5
"""Ends within this of each other may lie on one face, m."""
THICK: Final = 0.03
"""What the ends of a face differ from its line by, rms, m: the LiDAR's noise and a half; chosen."""
LONG: Final = 3.0
"""A face is at least so many times as long as thick: of less the direction cannot be told; chosen."""
_LEAST: Final = 1e-6
"""Of a thickness squared, m2: exact ranges have none."""


class Faces:
    """What one level scan has met, in the axes of its LiDAR: one row for each beam."""

    __slots__ = ("known", "looks", "middles", "normals", "points")

    def __init__(self, ranges: Floats, max_range: float = MAX_RANGE) -> None:
        count = len(ranges)
        met = returns(ranges, max_range)
        reach, angles = np.where(met, ranges, 0.0), beam_angles(count)
        self.looks: Floats = np.column_stack((np.cos(angles), np.sin(angles)))
        """Unit vectors along the beams, shape (n, 2)."""
        self.points: Floats = reach[:, None] * self.looks
        """Ends of the beams, m, shape (n, 2); zero without a return."""
        beside = (np.arange(count)[:, None] + np.arange(-BESIDE, BESIDE + 1)) % count
        off = self.points[beside] - self.points[:, None, :]
        same = met[beside] & met[:, None] & ((off**2).sum(axis=2) < SAME**2)
        fitted = same.sum(axis=1)
        share = same / np.maximum(fitted, 1)[:, None]
        mean = (share[:, :, None] * off).sum(axis=1)
        x, y = off[:, :, 0] - mean[:, :1], off[:, :, 1] - mean[:, 1:]
        xx, yy, xy = (share * x * x).sum(axis=1), (share * y * y).sum(axis=1), (share * x * y).sum(axis=1)
        middle, half = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        along = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        normals = np.column_stack((-np.sin(along), np.cos(along)))
        outward = (normals * self.points).sum(axis=1) > 0.0
        self.normals: Floats = np.where(outward[:, None], -normals, normals)
        """Unit vectors at right angles to the faces, towards the LiDAR, shape (n, 2)."""
        self.middles: Floats = self.points + mean
        """A place on each face, m, shape (n, 2)."""
        thick = np.maximum(middle - half, _LEAST)
        self.known: NDArray[np.bool_] = (fitted >= FEWEST) & (thick < THICK**2) & (middle + half > LONG**2 * thick)
        """Of which beams there is a face, shape (n,)."""
