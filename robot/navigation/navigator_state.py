"""What the navigator remembers of a goal, and the arithmetic of its poses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, Twist2, turned
from robot.navigation.local_field import LocalField
from robot.planning.errors import NavigationError

NOISE: Final = 0.05
"""A step of the estimated pose that is shorter is no walking, m."""


@dataclass(frozen=True, slots=True)
class Instant:
    """The instant of one step: its time (s), the pose for which its command is chosen, and the distances there."""

    time: float
    pose: Pose2
    field: LocalField


@dataclass(slots=True)
class Planned:
    """The latest planning for the goal."""

    at: float = -math.inf
    """s."""
    changes: int = 0
    """Of the surroundings at that time."""
    again: bool = True
    """Whether to replan at the next step, whatever has been seen since."""
    failure: NavigationError | None = None
    """Why it found no way; None when it did."""


@dataclass(slots=True)
class NarrowSearches:
    """The searches for poses through narrow places, for one goal."""

    tried_at: float = -math.inf
    """s."""
    misfits: int = 0
    """How many of them found nothing, since one did or since a place was closed."""


@dataclass(slots=True)
class Recoveries:
    """The recoveries for one goal."""

    count: int = 0
    at: Pose2 | None = None
    """Where the latest began; None once the robot has left that place."""


@dataclass(slots=True)
class Walked:
    """How far the robot has walked for one goal."""

    metres: float = 0.0
    planned: float = 0.0
    """The longest way to the goal that was planned, m."""
    last: Pose2 | None = None

    def to(self, pose: Pose2, least: float = NOISE) -> None:
        """The robot is here now; a step shorter than `least`, m, does not count."""
        step = apart(pose, self.last) if self.last is not None else math.inf
        if step >= least:
            self.metres += step if self.last is not None else 0.0
            self.last = pose


def apart(a: Pose2, b: Pose2) -> float:
    """Between their places, m."""
    return math.hypot(a.x - b.x, a.y - b.y)


def carried(pose: Pose2, velocity: Twist2, seconds: float) -> Pose2:
    """The pose a little later."""
    vx, vy = turned(pose.yaw, velocity.vx, velocity.vy)
    return Pose2(pose.x + vx * seconds, pose.y + vy * seconds, wrap(pose.yaw + velocity.wz * seconds))
