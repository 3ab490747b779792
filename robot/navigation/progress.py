"""Does the robot get anywhere, and what to try when it does not. Defaults and order after nav2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from robot.geometry.planar import Pose2


class Manoeuvre(StrEnum):
    """What can be tried when the robot does not get anywhere."""

    CLEAR = "clear"
    """Forget what was seen: it may be gone."""
    BACK_UP = "back_up"
    TURN = "turn"
    WAIT = "wait"


RECOVERIES = (Manoeuvre.CLEAR, Manoeuvre.BACK_UP, Manoeuvre.TURN, Manoeuvre.WAIT)
"""What is tried, in this order, before a goal is aborted."""

DISTANCE, WITHIN = 0.5, 10.0
"""A robot that moves less than this far (m) within this time (s) is stuck: nav2's progress checker."""


class ProgressChecker:
    """Stuck means: less than `distance` metres moved within `within` seconds."""

    def __init__(self, distance: float = DISTANCE, within: float = WITHIN) -> None:
        self.distance = distance
        self.within = within
        self._mark: Pose2 | None = None
        self._since = 0.0

    def reset(self) -> None:
        """Forget the past: the next `stuck` restarts the time."""
        self._mark = None

    def stuck(self, now: float, pose: Pose2) -> bool:
        """Note where the robot is at `now` (s); True once it has been too slow."""
        if self._mark is None or math.hypot(pose.x - self._mark.x, pose.y - self._mark.y) >= self.distance:
            self._mark, self._since = pose, now
        return now - self._since > self.within


@dataclass(frozen=True, slots=True)
class _Motion:
    """A constant velocity (m/s, rad/s) for so many seconds."""

    vx: float
    wz: float
    seconds: float


_MOTIONS = {
    Manoeuvre.CLEAR: _Motion(0.0, 0.0, 0.5),
    Manoeuvre.BACK_UP: _Motion(-0.15, 0.0, 2.0),  # nav2: 0.30 m at 0.15 m/s
    Manoeuvre.TURN: _Motion(0.0, 0.6, 2.6),  # nav2: 1.57 rad
    Manoeuvre.WAIT: _Motion(0.0, 0.0, 5.0),
}


class Recovery:
    """One walk through `RECOVERIES`: each `begin` starts the next manoeuvre, until none is left."""

    def __init__(self) -> None:
        self._tried = 0
        self._until = -math.inf
        self.current: Manoeuvre | None = None

    @property
    def tried(self) -> tuple[Manoeuvre, ...]:
        """What has been tried so far, in order."""
        return RECOVERIES[: self._tried]

    def reset(self) -> None:
        """Begin again from the first, after the robot moved on."""
        self._tried, self._until, self.current = 0, -math.inf, None

    def begin(self, now: float) -> Manoeuvre | None:
        """Start the next recovery and return its name, or None when all were tried."""
        if self._tried == len(RECOVERIES):
            return None
        self.current = RECOVERIES[self._tried]
        self._tried += 1
        self._until = now + _MOTIONS[self.current].seconds
        return self.current

    def command(self, now: float) -> tuple[float, float] | None:
        """(vx, wz) of the running manoeuvre, or None when it is over."""
        if self.current is None or now >= self._until:
            self.current = None
            return None
        motion = _MOTIONS[self.current]
        return motion.vx, motion.wz

    def give_up(self) -> None:
        """End the running manoeuvre early: there is no room for it."""
        self.current = None
