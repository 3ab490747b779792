"""The people and things that move in a scene: where each is, at one instant after the other."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np

from robot.geometry.planar import Pose2, seen_from
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Box, Obstacle, Scene

_PATIENT = 2.0
"""A person who has stood before the robot for so long goes to the next place, s."""
_ASIDE = 0.1
"""Between the two that pass each other, m."""
_NOWHERE = -100.0
"""Height of what has not appeared, m."""


class Walkers:
    """The walkers of a scene. Each goes straight from place to place, and stops for the robot if it is one who does."""

    def __init__(self, scene: Scene, model: RobotModel = SPOT) -> None:
        self._walkers = scene.walkers
        self._places: Floats = np.array(
            [(one.shape.x, one.shape.y) for one in scene.walkers], dtype=np.float64
        ).reshape(-1, 2)
        self._next = [0] * len(scene.walkers)
        self._stood = [0.0] * len(scene.walkers)
        self._time = 0.0
        self._footprint = Footprint.of(model)

    @property
    def places(self) -> Floats:
        """x, y and height of each, m, shape (n, 3); what has not appeared is deep under the floor."""
        there = [0.0 if self._time >= one.appears else _NOWHERE for one in self._walkers]
        return np.asarray(np.column_stack((self._places, there)), dtype=np.float64)

    @property
    def shapes(self) -> tuple[Obstacle, ...]:
        """Those that have appeared, where they are now."""
        there = zip(self._walkers, self._places.tolist(), strict=True)
        return tuple(replace(one.shape, x=x, y=y, mapped=False) for one, (x, y) in there if self._time >= one.appears)

    def advance(self, until: float, robot: Pose2) -> None:
        """Move them up to the instant `until`, s, with the robot there."""
        passed, self._time = until - self._time, until
        for index, one in enumerate(self._walkers):
            if one.way and until >= one.appears:
                self._walk(index, one.speed * passed, passed, robot)

    def _walk(self, index: int, step: float, passed: float, robot: Pose2) -> None:
        one, (x, y) = self._walkers[index], self._places[index].tolist()
        to_x, to_y = one.way[self._next[index] % len(one.way)]
        away = hypot(to_x - x, to_y - y)
        if away <= step:
            self._next[index] += 1
            return
        ahead = ((to_x - x) / away, (to_y - y) / away)
        if one.room > 0.0 and self._meets(one.shape, one.room, (x, y), ahead, robot):
            self._stood[index] += passed
            if self._stood[index] > _PATIENT:
                self._next[index] += 1
                self._stood[index] = 0.0
            return
        self._stood[index] = 0.0
        self._places[index] = (x + step * ahead[0], y + step * ahead[1])

    def _meets(
        self, shape: Obstacle, room: float, at: tuple[float, float], ahead: tuple[float, float], robot: Pose2
    ) -> bool:
        """Whether the robot's outline lies on the next `room` metres of somebody's way."""
        radius = hypot(shape.length, shape.width) / 2 if isinstance(shape, Box) else shape.radius
        reach = np.linspace(0.0, room, 4)
        gaps = self._footprint.distances(*seen_from(robot, at[0] + ahead[0] * reach, at[1] + ahead[1] * reach))
        return bool(gaps.min() < radius + _ASIDE and gaps[-1] <= gaps[0])
