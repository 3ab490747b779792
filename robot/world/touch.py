"""Which obstacles of a scene the robot's outline touches, seen from above: exact for rectangles and circles."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robot.world.body import Vector
from robot.world.model import obstacle_names
from robot.world.scene import Box, Cylinder, Obstacle, Scene

__all__ = ["LENGTH", "WIDTH", "touching"]

LENGTH, WIDTH = 1.10, 0.50
"""The robot's outline, m (data sheet)."""


def touching(scene: Scene, x: float, y: float, yaw: float) -> tuple[str, ...]:
    """Names of the obstacles that the robot's outline at a pose overlaps, in scene order. Heights are not looked at."""
    boxes, cylinders, box_index, cylinder_index = _columns(scene.obstacles)
    hits = np.concatenate((box_index[_overlap(boxes, x, y, yaw)], cylinder_index[_near(cylinders, x, y, yaw)]))
    if not hits.size:
        return ()
    names = obstacle_names(scene)
    return tuple(names[int(hit)] for hit in np.sort(hits))


def _near(cylinders: Vector, x: float, y: float, yaw: float) -> NDArray[np.bool_]:
    """Circles whose centre is nearer to the rectangle than their radius."""
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = cylinders[:, 0] - x, cylinders[:, 1] - y
    ahead = np.maximum(np.abs(c * dx + s * dy) - LENGTH / 2, 0.0)
    aside = np.maximum(np.abs(c * dy - s * dx) - WIDTH / 2, 0.0)
    return np.asarray(ahead * ahead + aside * aside < cylinders[:, 2] ** 2, dtype=np.bool_)


def _overlap(boxes: Vector, x: float, y: float, yaw: float) -> NDArray[np.bool_]:
    """Separating axes: two rectangles are apart if the axes of one of them show a gap."""
    dx, dy = boxes[:, 0] - x, boxes[:, 1] - y
    half_l, half_w = boxes[:, 2], boxes[:, 3]
    c, s = math.cos(yaw), math.sin(yaw)
    bc, bs = boxes[:, 4], boxes[:, 5]
    along, across = np.abs(bc * c + bs * s), np.abs(bs * c - bc * s)
    return np.asarray(
        (np.abs(c * dx + s * dy) < LENGTH / 2 + half_l * along + half_w * across)
        & (np.abs(c * dy - s * dx) < WIDTH / 2 + half_l * across + half_w * along)
        & (np.abs(bc * dx + bs * dy) < half_l + LENGTH / 2 * along + WIDTH / 2 * across)
        & (np.abs(bc * dy - bs * dx) < half_w + LENGTH / 2 * across + WIDTH / 2 * along),
        dtype=np.bool_,
    )


@lru_cache(maxsize=8)
def _columns(obstacles: tuple[Obstacle, ...]) -> tuple[Vector, Vector, NDArray[np.intp], NDArray[np.intp]]:
    """Boxes (x, y, half length, half width, cos, sin), cylinders (x, y, radius), and the scene indices of both."""
    boxes = [(i, o) for i, o in enumerate(obstacles) if isinstance(o, Box)]
    cylinders = [(i, o) for i, o in enumerate(obstacles) if isinstance(o, Cylinder)]
    rows = [(b.x, b.y, b.length / 2, b.width / 2, math.cos(b.yaw), math.sin(b.yaw)) for _, b in boxes]
    return (
        np.array(rows, dtype=np.float64).reshape(-1, 6),
        np.array([(c.x, c.y, c.radius) for _, c in cylinders], dtype=np.float64).reshape(-1, 3),
        np.array([i for i, _ in boxes], dtype=np.intp),
        np.array([i for i, _ in cylinders], dtype=np.intp),
    )
