"""Poses and velocities on the floor. Frames follow REP-103: x forward, y left, yaw counter-clockwise; metres, seconds and radians."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING, Final, TypeVar

from robot.geometry.angles import wrap

if TYPE_CHECKING:
    from robot.geometry.vectors import Floats  # it imports numpy, for which help does not wait

N = TypeVar("N", float, "Floats")
"""A number, or an array of them."""


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


def turned(yaw: float, x: N, y: N) -> tuple[N, N]:
    """A vector turned counter-clockwise by `yaw`: one of the axes of a body with this yaw, in those of the frame that it stands in."""
    c, s = cos(yaw), sin(yaw)
    return c * x - s * y, s * x + c * y


def turned_back(yaw: float, x: N, y: N) -> tuple[N, N]:
    """A vector turned clockwise by `yaw`: one of the frame that a body with this yaw stands in, in its axes. Undoes `turned`."""
    c, s = cos(yaw), sin(yaw)
    return c * x + s * y, c * y - s * x


def placed(pose: Pose2, x: N, y: N) -> tuple[N, N]:
    """A point that is given in the frame of `pose`, in the frame that `pose` is given in."""
    c, s = cos(pose.yaw), sin(pose.yaw)
    return pose.x + c * x - s * y, pose.y + s * x + c * y


def seen_from(pose: Pose2, x: N, y: N) -> tuple[N, N]:
    """A point in the frame of `pose`: how far ahead of it and to its left. Undoes `placed`."""
    return turned_back(pose.yaw, x - pose.x, y - pose.y)
