"""Exact distances from a point, or one for each beam, to the obstacles of a scene, all beams at once in numpy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robot.geometry.vectors import Floats
from robot.hardware.beams import BEAMS, MAX_RANGE, beam_angles
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene

__all__ = ["cast", "cast_in_space"]

_STEEPEST = 1e-12
"""Square of the level part of a beam's unit vector below which it counts as upright."""


@dataclass(frozen=True, slots=True)
class _Shapes:
    """The obstacles as columns: boxes (n, 6: x, y, cos, sin, half length, half width), cylinders (m, 3), and their
    heights.
    """

    boxes: Floats
    box_heights: Floats
    cylinders: Floats
    cylinder_heights: Floats


@lru_cache(maxsize=32)
def _shapes(obstacles: tuple[Obstacle, ...]) -> _Shapes:
    boxes = [o for o in obstacles if isinstance(o, Box)]
    cylinders = [o for o in obstacles if isinstance(o, Cylinder)]
    rows = [(b.x, b.y, math.cos(b.yaw), math.sin(b.yaw), b.length / 2, b.width / 2) for b in boxes]
    return _Shapes(
        boxes=np.array(rows, dtype=np.float64).reshape(-1, 6),
        box_heights=np.array([b.height for b in boxes], dtype=np.float64),
        cylinders=np.array([(c.x, c.y, c.radius) for c in cylinders], dtype=np.float64).reshape(-1, 3),
        cylinder_heights=np.array([c.height for c in cylinders], dtype=np.float64),
    )


def _box_hits(boxes: Floats, x: float, y: float, dx: Floats, dy: Floats) -> Floats:
    """Distance along each beam to the nearest box, inf for none: the slab method in every box's own axes."""
    bx, by, c, s, half_l, half_w = (column[:, None] for column in boxes.T)
    rel_x, rel_y = x - bx, y - by
    px, py = c * rel_x + s * rel_y, c * rel_y - s * rel_x
    ux, uy = c * dx + s * dy, c * dy - s * dx
    return _first(_between(px, ux, half_l), _between(py, uy, half_w))


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
    """Ranges (m), shape (beams,), from (x, y) to the scene's obstacles; beam i looks along yaw - pi + i 2 pi / beams.

    Exact to rounding, without noise. `max_range` means no return; a beam that starts inside an obstacle reads 0.
    `height` (m) is how high the beams travel: obstacles that are not taller are not seen.
    """
    shapes = _shapes(scene.obstacles)
    angles = beam_angles(beams) + yaw
    dx, dy = np.cos(angles), np.sin(angles)
    ranges = np.full(beams, max_range)
    boxes, cylinders = shapes.boxes, shapes.cylinders
    if height > 0.0:
        boxes, cylinders = boxes[shapes.box_heights > height], cylinders[shapes.cylinder_heights > height]
    if len(boxes):
        np.minimum(ranges, _box_hits(boxes, x, y, dx, dy), out=ranges)
    if len(cylinders):
        np.minimum(ranges, _cylinder_hits(cylinders, x, y, dx, dy), out=ranges)
    return ranges


def cast_in_space(scene: Scene, origins: Floats, directions: Floats, max_range: float = MAX_RANGE) -> Floats:
    """Ranges (m), shape (n,), along unit vectors (n, 3) from `origins` (3,) or (n, 3), world axes, to obstacles and a level floor at zero.

    Exact to rounding. `max_range` means no return; a beam that starts inside an obstacle or under the floor reads 0.
    """
    shapes = _shapes(scene.obstacles)
    x, y, z = np.broadcast_to(origins, directions.shape).T
    dx, dy, dz = directions.T
    down = dz < 0.0
    ranges = np.where(down, np.maximum(z, 0.0) / np.where(down, -dz, 1.0), max_range)
    if len(shapes.boxes):
        bx, by, c, s, half_l, half_w = (column[:, None] for column in shapes.boxes.T)
        rel_x, rel_y = x - bx, y - by
        level = (
            _between(c * rel_x + s * rel_y, c * dx + s * dy, half_l),
            _between(c * rel_y - s * rel_x, c * dy - s * dx, half_w),
        )
        np.minimum(ranges, _first(*level, _upright(z, dz, shapes.box_heights)), out=ranges)
    if len(shapes.cylinders):
        rel_x, rel_y, radius = x - shapes.cylinders[:, :1], y - shapes.cylinders[:, 1:2], shapes.cylinders[:, 2:]
        flat = np.maximum(dx * dx + dy * dy, _STEEPEST)
        middle = -(rel_x * dx + rel_y * dy) / flat
        across = rel_x * dy - rel_y * dx
        under = radius * radius * flat - across * across
        half = np.sqrt(np.maximum(under, 0.0)) / flat
        round_ = np.where(under >= 0.0, middle - half, np.inf), np.where(under >= 0.0, middle + half, -np.inf)
        np.minimum(ranges, _first(round_, _upright(z, dz, shapes.cylinder_heights)), out=ranges)
    return np.minimum(ranges, max_range)


def _between(start: Floats, speed: Floats, half: Floats) -> tuple[Floats, Floats]:
    """Where along each beam it enters and leaves the slab of half width `half` about zero, by one coordinate of the beam.

    A beam parallel to a face, or as good as parallel, gives +-inf, which min and max carry correctly. Only a beam that runs exactly in a
    face's plane gives 0 * inf = NaN: grazing without a hit, which is what fmin and fmax make of it.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = (-half - start) / speed, (half - start) / speed
    return np.fmin(one, other), np.fmax(one, other)


def _upright(z: Floats, dz: Floats, heights: Floats) -> tuple[Floats, Floats]:
    """Where along each beam it is between the floor and the top of each obstacle."""
    middle = heights[:, None] / 2
    return _between(z - middle, dz, middle)


def _first(*slabs: tuple[Floats, Floats]) -> Floats:
    """Distance along each beam to the first obstacle whose slabs it is in all at once; inf for none."""
    enter = np.fmax.reduce([near for near, _ in slabs])
    leave = np.fmin.reduce([far for _, far in slabs])
    hit = (leave >= enter) & (leave >= 0.0)
    return np.asarray(np.where(hit, np.maximum(enter, 0.0), np.inf).min(axis=0), dtype=np.float64)
