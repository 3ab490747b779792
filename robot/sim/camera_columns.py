"""Where the picture's columns meet upright boxes and cylinders: for every column the depth at which it enters and leaves each of them.

A column of a level camera is an upright plane, and so is every side of these shapes: one depth holds for a whole column.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import turned_back
from robot.geometry.vectors import Floats
from robot.hardware.lens import CX, FOCAL, WIDTH, column_slopes
from robot.scenes.scene import Box, Cylinder, Obstacle

NEAREST = 0.05
"""Nothing is seen nearer than this, m."""
_SLOPES = column_slopes()
_RAY = np.hypot(1.0, _SLOPES)
"""Length of a ray per metre of depth."""
_EDGE = WIDTH / 2 / FOCAL
_EDGE_LENGTH = hypot(1.0, _EDGE)


@dataclass(frozen=True, slots=True)
class Eye:
    """Where a level camera is: m and rad in the world."""

    x: float
    y: float
    z: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Hits:
    """For k shapes in view and n columns: depths (m) of entry and exit, inf where it misses, and how squarely the side is met."""

    which: NDArray[np.intp]
    """Their places in the list of shapes, shape (k,)."""
    enter: Floats
    """Shape (k, n)."""
    leave: Floats
    """Shape (k, n)."""
    facing: Floats
    """Cosine of the angle between ray and the side's normal, 0..1, shape (k, n)."""


class Prisms:
    """Upright shapes, prepared to be looked at from anywhere."""

    def __init__(self, shapes: Sequence[Obstacle]) -> None:
        self._boxes = [(place, one) for place, one in enumerate(shapes) if isinstance(one, Box)]
        self._cylinders = [(place, one) for place, one in enumerate(shapes) if isinstance(one, Cylinder)]
        boxes = [(b.x, b.y, cos(b.yaw), sin(b.yaw), b.length / 2, b.width / 2) for _, b in self._boxes]
        self._box = np.array(boxes, dtype=np.float64).reshape(-1, 6)
        self._box_place = np.array([place for place, _ in self._boxes], dtype=np.intp)
        self._box_reach = np.hypot(self._box[:, 4], self._box[:, 5])
        cylinders = [(c.x, c.y, c.radius) for _, c in self._cylinders]
        self._cylinder = np.array(cylinders, dtype=np.float64).reshape(-1, 3)
        self._cylinder_place = np.array([place for place, _ in self._cylinders], dtype=np.intp)

    def seen_from(self, eye: Eye, farthest: float, columns: slice = slice(None)) -> Hits:
        """Those that may be in the picture, within `farthest` m; the arrays are of these columns."""
        boxes = _in_view(self._box, self._box_reach, eye, farthest)
        cylinders = _in_view(self._cylinder, self._cylinder[:, 2], eye, farthest)
        first = _box_hits(self._box[boxes], eye, columns)
        second = _cylinder_hits(self._cylinder[cylinders], eye, columns)
        enter, leave, facing = (np.vstack(pair) for pair in zip(first, second, strict=True))
        gone = ~((leave > enter) & (leave > NEAREST))
        enter = np.maximum(enter, NEAREST)
        enter[gone] = np.inf
        leave[gone] = np.inf
        which = np.concatenate((self._box_place[boxes], self._cylinder_place[cylinders]))
        return Hits(which, enter, leave, facing)


def columns_of(shape: Obstacle, eye: Eye, farthest: float) -> slice | None:
    """The columns in which a shape may be seen; None for none. All of them when it is as near as it is wide."""
    reach = shape.radius if isinstance(shape, Cylinder) else hypot(shape.length, shape.width) / 2
    ahead, left = turned_back(eye.yaw, shape.x - eye.x, shape.y - eye.y)
    if not -reach < ahead < farthest + reach:
        return None
    if ahead < 2.0 * reach:
        return slice(0, WIDTH)
    # a circle around it: the slopes of its two tangents lie within these
    ends = [(left + side * reach) / (ahead - side_x * reach) for side in (-1.0, 1.0) for side_x in (-1.0, 1.0)]
    first, last = int(CX - FOCAL * max(ends)) - 1, int(CX - FOCAL * min(ends)) + 2
    first, last = max(first, 0), min(last, WIDTH)
    return slice(first, last) if first < last else None


def _in_view(shapes: Floats, reach: Floats, eye: Eye, farthest: float) -> NDArray[np.bool_]:
    """Whether any part of a shape within `reach` of its middle can lie in the picture; it may say yes too often."""
    ahead, left = turned_back(eye.yaw, shapes[:, 0] - eye.x, shapes[:, 1] - eye.y)
    inside = np.abs(left) - _EDGE * ahead <= reach * _EDGE_LENGTH
    return np.asarray(inside & (ahead > -reach) & (ahead < farthest + reach), dtype=np.bool_)


def _box_hits(boxes: Floats, eye: Eye, columns: slice) -> tuple[Floats, Floats, Floats]:
    """The slab method in every box's own axes; a ray is (1, slope) in the camera's, so its parameter is depth."""
    slopes = _SLOPES[columns]
    bx, by, c, s, half_l, half_w = (column[:, None] for column in boxes.T)
    turn_c, turn_s = cos(eye.yaw) * c + sin(eye.yaw) * s, sin(eye.yaw) * c - cos(eye.yaw) * s
    rel_x, rel_y = eye.x - bx, eye.y - by
    px, py = c * rel_x + s * rel_y, c * rel_y - s * rel_x
    ux, uy = turn_c - turn_s * slopes, turn_s + turn_c * slopes
    # Rays along a side give inf, and NaN in its very plane, which is a miss.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inv_x, inv_y = 1.0 / ux, 1.0 / uy
        mid_x, mid_y = -px * inv_x, -py * inv_y
        wide_x, wide_y = half_l * np.abs(inv_x), half_w * np.abs(inv_y)
        by_x, by_y = mid_x - wide_x, mid_y - wide_y
        enter, leave = np.maximum(by_x, by_y), np.minimum(mid_x + wide_x, mid_y + wide_y)
        facing = np.asarray(np.where(by_x > by_y, np.abs(ux), np.abs(uy)) / _RAY[columns], dtype=np.float64)
    return enter, leave, facing


def _cylinder_hits(cylinders: Floats, eye: Eye, columns: slice) -> tuple[Floats, Floats, Floats]:
    x, y, radius = (column[:, None] for column in cylinders.T)
    ahead, left = turned_back(eye.yaw, x - eye.x, y - eye.y)
    slopes = _SLOPES[columns]
    square = 1.0 + slopes * slopes
    along = (ahead + left * slopes) / square
    miss = (left - ahead * slopes) ** 2 / square
    under = radius * radius - miss
    half = np.sqrt(np.maximum(under, 0.0) / square)
    enter = np.where(under > 0.0, along - half, np.inf)
    facing = np.sqrt(np.maximum(under, 0.0)) / radius
    return enter, np.where(under > 0.0, along + half, -np.inf), facing
