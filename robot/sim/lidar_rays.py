"""The ideal LiDAR: exact distances from a point to the obstacles and ramps of a scene, all beams at once in numpy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.hardware.beams import BEAMS, MAX_RANGE, beam_angles
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene
from robot.sim.depth_rays import sight


@dataclass(frozen=True, slots=True)
class _Shapes:
    """The obstacles as columns: boxes (n, 6: x, y, cos, sin, half length, half width), cylinders (m, 3), and between which heights they
    stand or hang (k, 2).
    """

    boxes: Floats
    box_heights: Floats
    cylinders: Floats
    cylinder_heights: Floats

    def at(self, height: float) -> tuple[Floats, Floats]:
        """The boxes and cylinders that a level beam so high (m) may meet."""
        boxes, cylinders = (_crossed(heights, height) for heights in (self.box_heights, self.cylinder_heights))
        return self.boxes[boxes], self.cylinders[cylinders]


def _crossed(heights: Floats, height: float) -> NDArray[np.bool_]:
    return (heights[:, 0] <= height) & (heights[:, 1] > height)


@lru_cache(maxsize=32)
def _shapes(obstacles: tuple[Obstacle, ...]) -> _Shapes:
    boxes = [o for o in obstacles if isinstance(o, Box)]
    cylinders = [o for o in obstacles if isinstance(o, Cylinder)]
    rows = [(b.x, b.y, math.cos(b.yaw), math.sin(b.yaw), b.length / 2, b.width / 2) for b in boxes]
    return _Shapes(
        boxes=np.array(rows, dtype=np.float64).reshape(-1, 6),
        box_heights=np.array([(b.bottom, b.height) for b in boxes], dtype=np.float64).reshape(-1, 2),
        cylinders=np.array([(c.x, c.y, c.radius) for c in cylinders], dtype=np.float64).reshape(-1, 3),
        cylinder_heights=np.array([(c.bottom, c.height) for c in cylinders], dtype=np.float64).reshape(-1, 2),
    )


def _box_hits(boxes: Floats, x: float, y: float, dx: Floats, dy: Floats) -> Floats:
    """Distance along each beam to the nearest box, inf for none: the slab method in every box's own axes."""
    bx, by, c, s, half_l, half_w = (column[:, None] for column in boxes.T)
    rel_x, rel_y = x - bx, y - by
    px, py = c * rel_x + s * rel_y, c * rel_y - s * rel_x
    ux, uy = c * dx + s * dy, c * dy - s * dx
    # A beam parallel to a face, or as good as parallel, gives +-inf, which min and max carry correctly. Only a beam that runs exactly in a
    # face's plane gives 0 * inf = NaN: grazing without a hit, which is what fmin and fmax make of it.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inv_x, inv_y = 1.0 / ux, 1.0 / uy
        near_x, far_x = (-half_l - px) * inv_x, (half_l - px) * inv_x
        near_y, far_y = (-half_w - py) * inv_y, (half_w - py) * inv_y
    enter = np.fmax(np.fmin(near_x, far_x), np.fmin(near_y, far_y))
    leave = np.fmin(np.fmax(near_x, far_x), np.fmax(near_y, far_y))
    hit = (leave >= enter) & (leave >= 0.0)
    return np.asarray(np.where(hit, np.maximum(enter, 0.0), np.inf).min(axis=0), dtype=np.float64)


def _cylinder_hits(cylinders: Floats, x: float, y: float, dx: Floats, dy: Floats) -> Floats:
    """Distance along each beam to the nearest cylinder, inf for none."""
    rel_x, rel_y, radius = x - cylinders[:, :1], y - cylinders[:, 1:2], cylinders[:, 2:]
    along = rel_x * dx + rel_y * dy
    across = rel_x * dy - rel_y * dx
    under = radius * radius - across * across
    root = np.sqrt(np.maximum(under, 0.0))
    hit = (under >= 0.0) & (root >= along)
    return np.asarray(np.where(hit, np.maximum(-along - root, 0.0), np.inf).min(axis=0), dtype=np.float64)


def cast(
    scene: Scene, x: float, y: float, yaw: float, beams: int = BEAMS, max_range: float = MAX_RANGE, height: float = 0.0
) -> Floats:
    """Ranges (m), shape (beams,), from (x, y) to the scene's obstacles and terrain; beam i looks along yaw - pi + i 2 pi / beams.

    Exact to rounding, without noise. `max_range` means no return; a beam that starts inside an obstacle reads 0.
    `height` (m) is how high the beams travel: what is not taller, or hangs higher, is not seen; at 0 all obstacles are, and no terrain.
    """
    shapes = _shapes(scene.obstacles)
    angles = beam_angles(beams) + yaw
    dx, dy = np.cos(angles), np.sin(angles)
    ranges = np.full(beams, max_range)
    boxes, cylinders = shapes.boxes, shapes.cylinders
    if height > 0.0:
        boxes, cylinders = shapes.at(height)
    if len(boxes):
        np.minimum(ranges, _box_hits(boxes, x, y, dx, dy), out=ranges)
    if len(cylinders):
        np.minimum(ranges, _cylinder_hits(cylinders, x, y, dx, dy), out=ranges)
    if scene.terrain and height > 0.0:
        level = np.column_stack((dx, dy, np.zeros(beams)))
        np.minimum(ranges, sight((), (), np.array([x, y, height]), level, max_range, scene.terrain), out=ranges)
    return ranges
