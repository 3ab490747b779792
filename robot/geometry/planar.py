"""Poses and velocities on the floor. Frames follow REP-103: x forward, y left, yaw counter-clockwise; metres, seconds and radians."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import Final

from robot.geometry.angles import wrap


@dataclass(frozen=True, slots=True)
class Pose2:
    """A place on the floor: x and y in metres, yaw in radians."""

    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class Twist2:
    """A velocity on the floor in body axes: forward and left in m/s, counter-clockwise in rad/s."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0

    def over(self, seconds: float) -> Pose2:
        """How far it leads in a short time, in the frame of the body at its beginning; first order."""
        return Pose2(self.vx * seconds, self.vy * seconds, self.wz * seconds)


ZERO_TWIST: Final = Twist2()


def compose(outer: Pose2, inner: Pose2) -> Pose2:
    """`inner`, given in the frame that `outer` is the pose of, in the frame of `outer`."""
    c, s = cos(outer.yaw), sin(outer.yaw)
    return Pose2(outer.x + c * inner.x - s * inner.y, outer.y + s * inner.x + c * inner.y, wrap(outer.yaw + inner.yaw))


def inverse(pose: Pose2) -> Pose2:
    """The pose of the outer frame in the inner one: `compose(pose, inverse(pose))` is the origin."""
    c, s = cos(pose.yaw), sin(pose.yaw)
    return Pose2(-c * pose.x - s * pose.y, s * pose.x - c * pose.y, -pose.yaw)
