"""Ground that is not level: how high it is in the cells of a map, which of it can be walked on, and which returns of a LiDAR are its own."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, tan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import turned_back
from robot.geometry.vectors import Floats
from robot.model.parameters import FOOT_RADIUS, STAND_HEIGHT
from robot.scenes.terrain import Ramp

STEEPEST: Final = radians(20.0)
"""The steepest slope that is planned over, rad; chosen: the robot crosses its crests at a friction of 0.6
(docs/reference/figures.md#missions-and-hard-ground). Steeper ground counts as a wall.
"""
_STEP: Final = 0.12
"""The highest step from cell to cell that does not, m: what the trot crosses without seeing where it treads."""
_ROUNDING: Final = 1e-6
"""20 degrees are no more than 20 degrees."""
_PLANE: Final = STAND_HEIGHT + FOOT_RADIUS
"""Height of the LiDAR over the ground, m; while the robot walks it is up to 7 cm higher."""
_UNDER: Final = 0.15
"""Ground that comes so near to the LiDAR's plane may return its beams, m: a body that leans by 3 degrees looks so much lower 3 m away."""


def ground_of(
    terrain: Sequence[Ramp], x: Floats, y: Floats, free: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Height (m) of the ground at each point of a raster: that of the highest piece there, 0 beside them all; and where it cannot be walked
    on: on what is steeper than `STEEPEST`, and on both sides of a step that is too high, if both are `free` of obstacles.
    """
    heights = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    blocked = np.zeros(heights.shape, dtype=np.bool_)
    for piece in terrain:
        along, across = turned_back(piece.yaw, x - piece.x, y - piece.y)
        inside = (np.abs(along) <= piece.length / 2) & (np.abs(across) <= piece.width / 2)
        here = (piece.bottom + piece.top) / 2 + along * tan(piece.rise)
        heights = np.maximum(heights, np.where(inside, here, 0.0))
        blocked |= inside & (abs(piece.rise) > STEEPEST + _ROUNDING)
    for first, second in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        high = (np.abs(heights[second] - heights[first]) > _STEP) & free[first] & free[second]
        blocked[first] |= high
        blocked[second] |= high
    return heights, blocked


def rises_to_lidar(heights: Floats, stands_on: float) -> NDArray[np.bool_]:
    """Which ground, so high (m), returns the beams of a LiDAR on a robot that stands on ground of the height `stands_on`, m."""
    return np.asarray(heights > stands_on + _PLANE - _UNDER)
