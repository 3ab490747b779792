"""The last steps onto the dock: filtering the sights of the station, and the velocity towards a pose, without clock and node.

Equations: docs/concepts/control.md#docking.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, Twist2, compose, inverse, turned_back


@dataclass(frozen=True, slots=True)
class DockConfig:
    """The numbers of docking. All were chosen, on the built-in worlds with a dock, unless they say otherwise."""

    # -- the control law
    period: float = 0.05
    """Between two commands, s: half the period of the scans."""
    gain: float = 1.2
    """Speed per distance from the pose, 1/s: a time constant of 0.8 s, several times that of the gait."""
    turn_gain: float = 1.5
    """Turning rate per turn that is left, 1/s: the heading settles before the place."""
    ahead_speed: float = 0.25
    """Bound of the speed forward and backward, m/s: at most 2.5 cm of way between two scans."""
    side_speed: float = 0.12
    """Bound of the speed sideways, m/s."""
    turn_speed: float = 0.4
    """Bound of the turning rate, rad/s."""
    close: float = 0.025
    """On the dock: so near to its pose, m: what single sights scatter by; the contacts close within 30 cm."""
    straight: float = 0.04
    """And so straight, rad: 2 cm at the body's ends."""

    # -- seeing the station
    share: float = 0.2
    """Share of each sight that is taken at once; half of the single scans are wrong by less than 3 cm (measured), five of them by 1 cm."""
    looks: int = 6
    """Sights before the station counts as found: just over the five of which `share` makes a mean."""
    settling: float = 1.0
    """How long to stand before the first step, s: the mean of ten scans, and the gait has come to rest."""
    finding: float = 3.0
    """How long to look for the station, s: thirty scans."""
    lost: float = 1.0
    """How long it may be out of sight on the way, s: 25 cm at the highest speed."""

    # -- waiting for others
    rising: float = 10.0
    """For walking or standing, s: standing up takes 2."""
    sitting: float = 8.0
    """For sitting, s: it takes 2 when the robot stands."""
    contact: float = 3.0
    """For the charger to be felt, s: the battery reports once a second."""


NONE = Pose2(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Sight:
    """What has been seen of the station in one attempt."""

    correction: Pose2 = NONE
    """From the pose in the dock's frame by the map to the one by sight."""
    count: int = 0
    at: float = 0.0
    """When it was seen last, s."""

    def with_one_more(self, seen: Pose2, by_map: Pose2, now: float, share: float) -> Sight:
        """The mean of the first few, then a filter that takes `share` of each; both poses are in the dock's frame."""
        off, was = compose(seen, inverse(by_map)), self.correction
        part = max(share, 1.0 / (self.count + 1))
        correction = Pose2(
            was.x + part * (off.x - was.x), was.y + part * (off.y - was.y), was.yaw + part * wrap(off.yaw - was.yaw)
        )
        return Sight(correction, self.count + 1, now)


def remaining(pose: Pose2, target: Pose2) -> float:
    """Distance to the target, m."""
    return hypot(target.x - pose.x, target.y - pose.y)


def approach(pose: Pose2, target: Pose2, config: DockConfig) -> Twist2 | None:
    """The velocity in body axes from `pose` towards `target`, both in one frame; None when it is there.

    (vx, vy) = gain R(-yaw) (target - pose), both shrunk together where one exceeds its bound, so that the way stays straight;
    wz = turn_gain wrap(target.yaw - yaw) within its bound. Forward, backward and sideways as need be.
    """
    ahead, left, turn = target.x - pose.x, target.y - pose.y, wrap(target.yaw - pose.yaw)
    if hypot(ahead, left) < config.close and abs(turn) < config.straight:
        return None
    vx, vy = (config.gain * part for part in turned_back(pose.yaw, ahead, left))
    slow = max(1.0, abs(vx) / config.ahead_speed, abs(vy) / config.side_speed)
    wz = min(max(config.turn_gain * turn, -config.turn_speed), config.turn_speed)
    return Twist2(vx / slow, vy / slow, wz)
