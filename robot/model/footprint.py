"""The body as a rectangle on the floor, and how near it comes to things."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robot.geometry.vectors import Floats
from robot.model.parameters import ABDUCTION, HIPS
from robot.model.robot import RobotModel

_SPACING = 0.1
"""Outline points at most this far apart, m: a post of 15 cm that touches the outline between two of them counts as 1.5 cm away."""


@dataclass(frozen=True)
class Footprint:
    """A rectangle around the body; Spot's sheet gives 1.1 x 0.5 m."""

    length: float = 1.1
    width: float = 0.5
    ahead: float = 0.0
    """How far the rectangle's middle lies ahead of the body's origin, m; negative when the body reaches farther back."""

    @classmethod
    def of(cls, model: RobotModel) -> Footprint:
        """What a robot keeps clear: the rectangle of its hips and feet, with the reference body's room about it in proportion."""
        own, (x, y) = cls(), model.nominal[0]
        room, aside = own.length - 2.0 * HIPS[0][0], own.width - 2.0 * (HIPS[0][1] + ABDUCTION)
        return cls(
            max(2.0 * x + room * model.length, model.trunk[0]), max(2.0 * y + aside * model.length, model.trunk[1])
        )

    @property
    def inscribed(self) -> float:
        """Half the width, m: nothing nearer than this can be passed in any direction."""
        return self.width / 2

    @property
    def circumscribed(self) -> float:
        """Radius of the circle that the farthest corners run on when the robot turns, m."""
        return math.hypot(self.length / 2 + abs(self.ahead), self.width / 2)

    @cached_property
    def outline(self) -> Floats:
        """Points on the edge in body axes, shape (n, 2), metres."""
        along = np.linspace(-self.length / 2, self.length / 2, math.ceil(self.length / _SPACING) + 1)
        across = np.linspace(-self.width / 2, self.width / 2, math.ceil(self.width / _SPACING) + 1)[1:-1]
        sides = [(x, y) for x in along for y in (-self.width / 2, self.width / 2)]
        ends = [(x, y) for y in across for x in (-self.length / 2, self.length / 2)]
        return np.array([(x + self.ahead, y) for x, y in sides + ends])

    def placed(self, x: Floats, y: Floats, yaw: Floats) -> tuple[Floats, Floats]:
        """Outline points of the body at every pose: two arrays of the poses' shape with one axis more."""
        c, s = np.cos(yaw)[..., None], np.sin(yaw)[..., None]
        px, py = self.outline.T
        return x[..., None] + c * px - s * py, y[..., None] + s * px + c * py

    def distances(self, x: Floats, y: Floats) -> Floats:
        """Distance (m) from points in body axes to the rectangle, 0 inside."""
        return np.asarray(
            np.hypot(
                np.maximum(np.abs(x - self.ahead) - self.length / 2, 0.0), np.maximum(np.abs(y) - self.width / 2, 0.0)
            ),
            dtype=np.float64,
        )
