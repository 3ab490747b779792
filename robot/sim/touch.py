"""Which obstacles of a scene the robot's outline touches, seen from above: exact for rectangles and circles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import turned_back
from robot.model.footprint import Footprint
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.mjcf import obstacle_names


class Outline:
    """The robot's rectangle among the obstacles of one scene. Heights are not looked at."""

    __slots__ = ("_box_names", "_boxes", "_cylinder_names", "_cylinders", "_length", "_order", "_width")

    def __init__(self, scene: Scene, model: RobotModel = SPOT) -> None:
        footprint = Footprint.of(model)
        self._length, self._width = footprint.length, footprint.width
        named = list(zip(obstacle_names(scene), scene.obstacles, strict=True))
        boxes = [(name, o) for name, o in named if isinstance(o, Box)]
        cylinders = [(name, o) for name, o in named if isinstance(o, Cylinder)]
        self._order = {name: place for place, (name, _) in enumerate(named)}
        self._box_names = [name for name, _ in boxes]
        self._cylinder_names = [name for name, _ in cylinders]
        rows = [(b.x, b.y, b.length / 2, b.width / 2, math.cos(b.yaw), math.sin(b.yaw)) for _, b in boxes]
        self._boxes = np.array(rows, dtype=np.float64).reshape(-1, 6).T
        self._cylinders = np.array([(c.x, c.y, c.radius) for _, c in cylinders], dtype=np.float64).reshape(-1, 3).T

    def touching(self, x: float, y: float, yaw: float) -> tuple[str, ...]:
        """Names of the obstacles that the rectangle at this pose overlaps, in scene order."""
        names: list[str] = []
        if self._box_names:
            names += [self._box_names[i] for i in np.flatnonzero(self._on_boxes(x, y, yaw)).tolist()]
        if self._cylinder_names:
            names += [self._cylinder_names[i] for i in np.flatnonzero(self._on_cylinders(x, y, yaw)).tolist()]
        return tuple(sorted(names, key=self._order.__getitem__))

    def _on_cylinders(self, x: float, y: float, yaw: float) -> NDArray[np.bool_]:
        """Circles whose centre is nearer to the rectangle than their radius."""
        cx, cy, radius = self._cylinders
        along, across = turned_back(yaw, cx - x, cy - y)
        ahead = np.maximum(np.abs(along) - self._length / 2, 0.0)
        aside = np.maximum(np.abs(across) - self._width / 2, 0.0)
        return np.asarray(ahead * ahead + aside * aside < radius * radius, dtype=np.bool_)

    def _on_boxes(self, x: float, y: float, yaw: float) -> NDArray[np.bool_]:
        """Separating axes: two rectangles are apart if the axes of one of them show a gap."""
        c, s = math.cos(yaw), math.sin(yaw)
        bx, by, half_l, half_w, bc, bs = self._boxes
        dx, dy = bx - x, by - y
        along, across = np.abs(bc * c + bs * s), np.abs(bs * c - bc * s)
        return np.asarray(
            (np.abs(c * dx + s * dy) < self._length / 2 + half_l * along + half_w * across)
            & (np.abs(c * dy - s * dx) < self._width / 2 + half_l * across + half_w * along)
            & (np.abs(bc * dx + bs * dy) < half_l + self._length / 2 * along + self._width / 2 * across)
            & (np.abs(bc * dy - bs * dx) < half_w + self._length / 2 * across + self._width / 2 * along),
            dtype=np.bool_,
        )
