"""Walking on the floor in small steps: the geometry that the tutorials' movers share. Pure functions of values."""

from __future__ import annotations

import math

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2


def distance(here: Pose2, there: Pose2) -> float:
    """Metres between two places."""
    return math.hypot(there.x - here.x, there.y - here.y)


def turn_left(here: Pose2, there: Pose2) -> float:
    """How far `here` has to turn to look where `there` looks, rad, the shorter way."""
    return wrap(there.yaw - here.yaw)


def is_finite(pose: Pose2) -> bool:
    """Whether no part of it is NaN or infinite."""
    return all(map(math.isfinite, (pose.x, pose.y, pose.yaw)))


def turned(yaw: float, to: float, most: float) -> float:
    """`yaw` turned the shorter way to `to`, by `most` rad at most."""
    around = wrap(to - yaw)
    return to if abs(around) <= most else yaw + math.copysign(most, around)


def stride(here: Pose2, there: Pose2, step: float, turn: float) -> Pose2:
    """One step straight to `there` and a turn to its heading, of at most `step` m and `turn` rad; never beyond either."""
    left, yaw = distance(here, there), turned(here.yaw, there.yaw, turn)
    if left <= step:
        return Pose2(there.x, there.y, yaw)
    share = step / left
    return Pose2(here.x + share * (there.x - here.x), here.y + share * (there.y - here.y), yaw)
