"""Where to stand for a picture of the robot: before it and to one side, with nothing in the way and depth behind it."""

from __future__ import annotations

from math import cos, degrees, pi, radians, sin

import numpy as np

from robot.picture.camera import Camera
from robot.world.rays import cast
from robot.world.scene import Pose2, Scene

__all__ = ["viewpoint"]

DISTANCE = 2.8
"""From the robot to the eye on the floor, m, where there is room."""
HEIGHT = 1.3
ROOM = 0.4
"""From the eye to the nearest obstacle in its back, m."""
SIDEWAYS = radians(38.0)
"""The favourite angle off the robot's heading."""
BEARINGS, ASIDE = 72, 2
"""Directions that are tried, and how many on either side must be free too: 10 degrees, so that the whole robot is seen."""


def viewpoint(scene: Scene, robot: Pose2, width: int, height: int) -> Camera:
    """A camera for the robot at this pose; the same for the same pose."""
    beams = cast(scene, robot.x, robot.y, robot.yaw, BEARINGS, max_range=8.0)
    free = np.minimum.reduce([np.roll(beams, turn) for turn in range(-ASIDE, ASIDE + 1)])

    def value(beam: int) -> float:
        off = abs(_bearing(beam))
        room = min(free[beam] - ROOM, DISTANCE)
        behind = beams[(beam + BEARINGS // 2) % BEARINGS]
        return float(2.0 * room + 0.15 * behind - degrees(abs(off - SIDEWAYS)) / 30.0)

    best = max(range(BEARINGS), key=value)
    bearing = robot.yaw + _bearing(best)
    away = max(1.2, min(float(free[best]) - ROOM, DISTANCE))
    eye = np.array((robot.x + away * cos(bearing), robot.y + away * sin(bearing), HEIGHT))
    target = np.array((robot.x + 0.2 * cos(robot.yaw), robot.y + 0.2 * sin(robot.yaw), 0.42))
    return Camera(eye, target, width, height)


def _bearing(beam: int) -> float:
    return -pi + beam * 2.0 * pi / BEARINGS
