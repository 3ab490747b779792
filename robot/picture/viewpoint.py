"""Where to stand for a picture of the robot: before it and to one side, with nothing in the way and depth behind it."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, degrees, hypot, pi, radians, sin

import numpy as np

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.picture.camera import Camera
from robot.scenes.scene import Scene, Thing
from robot.sim.lidar_rays import cast

DISTANCE = 2.8
"""From the robot to the eye on the floor, m, where there is room."""
HEIGHT = 1.3
ROOM = 0.4
"""From the eye to the nearest obstacle in its back, m."""
SIDEWAYS = radians(38.0)
"""The favourite angle off the robot's heading."""
BESIDE = radians(9.0), radians(26.0)
"""How far beside the robot a thing is seen: neither behind it nor outside of the picture, which is 66 degrees wide."""
SHOWN = 6.0
"""What it is worth to see a thing: more than any room between eye and robot, if there is enough for a picture."""
ENOUGH = 2.0
"""How far an eye must be from the robot to have both in the picture, m."""
BEARINGS, ASIDE = 72, 2
"""Directions that are tried, and how many on either side must be free too: 10 degrees, so that the whole robot is seen."""


def viewpoint(scene: Scene, robot: Pose2, width: int, height: int, things: Sequence[Thing] = ()) -> Camera:
    """A camera for the robot at this pose; the same for the same pose. It looks for a place with the nearest of the things in view, too."""
    beams = cast(scene, robot.x, robot.y, robot.yaw, BEARINGS, max_range=8.0)
    free = np.minimum.reduce([np.roll(beams, turn) for turn in range(-ASIDE, ASIDE + 1)])

    def value(beam: int) -> float:
        off = abs(_bearing(beam))
        room = min(free[beam] - ROOM, DISTANCE)
        behind = beams[(beam + BEARINGS // 2) % BEARINGS]
        worth = float(2.0 * room + 0.15 * behind - degrees(abs(off - SIDEWAYS)) / 30.0)
        both = thing is not None and room >= ENOUGH and _beside(thing, robot, robot.yaw + _bearing(beam), room)
        return worth + SHOWN if both else worth

    thing = min(
        ((thing.shape.x, thing.shape.y) for thing in things),
        key=lambda place: hypot(place[0] - robot.x, place[1] - robot.y),
        default=None,
    )
    best = max(range(BEARINGS), key=value)
    bearing = robot.yaw + _bearing(best)
    away = max(1.2, min(float(free[best]) - ROOM, DISTANCE))
    eye = np.array((robot.x + away * cos(bearing), robot.y + away * sin(bearing), HEIGHT))
    target = np.array((robot.x + 0.2 * cos(robot.yaw), robot.y + 0.2 * sin(robot.yaw), 0.42))
    return Camera(eye, target, width, height)


def _beside(thing: tuple[float, float], robot: Pose2, bearing: float, away: float) -> bool:
    """Whether an eye at this bearing and distance from the robot sees the thing in the picture, and not behind the robot."""
    x, y = robot.x + away * cos(bearing), robot.y + away * sin(bearing)
    aside = wrap(atan2(thing[1] - y, thing[0] - x) - (bearing + pi))
    return BESIDE[0] <= abs(aside) <= BESIDE[1]


def _bearing(beam: int) -> float:
    return -pi + beam * 2.0 * pi / BEARINGS
