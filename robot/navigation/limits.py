"""Bounds of the velocities that navigation commands, and of what counts as there."""

from __future__ import annotations

from dataclasses import dataclass

from robot.geometry.planar import Twist2


@dataclass(frozen=True, slots=True)
class Limits:
    """What may be commanded. Speeds rise no faster than the accelerations say; braking is never delayed."""

    vx_min: float = -0.3
    vx_max: float = 0.8
    vy_max: float = 0.3
    wz_max: float = 1.0
    acceleration: float = 1.0
    """m/s2, for vx and vy."""
    turn_acceleration: float = 3.0
    """rad/s2."""
    creep: float = 0.3
    """Forward speed where the body nearly touches something, m/s."""
    eagerness: float = 2.0
    """How much faster it may walk per meter of room around the body, 1/s."""

    def clip(self, vx: float, vy: float, wz: float) -> Twist2:
        """The nearest command within the limits."""
        return Twist2(
            min(max(vx, self.vx_min), self.vx_max),
            min(max(vy, -self.vy_max), self.vy_max),
            min(max(wz, -self.wz_max), self.wz_max),
        )

    def pace(self, clearance: float) -> float:
        """The fastest walk, m/s, with so much room to spare around the body, m."""
        return min(self.creep + self.eagerness * max(clearance, 0.0), self.vx_max)

    def ramp(self, wanted: Twist2, last: Twist2, dt: float) -> Twist2:
        """`wanted`, but no faster than `last` plus what the accelerations allow in `dt` seconds."""
        step, turn = self.acceleration * dt, self.turn_acceleration * dt
        return Twist2(_slew(wanted.vx, last.vx, step), _slew(wanted.vy, last.vy, step), _slew(wanted.wz, last.wz, turn))


def _slew(wanted: float, last: float, step: float) -> float:
    """Limit only the growth of the magnitude; a change of sign starts from zero."""
    if wanted * last < 0.0:
        last = 0.0
    bound = abs(last) + step
    return min(max(wanted, -bound), bound)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How near counts as there: metres and radians, by the robot's own estimate."""

    position: float = 0.06
    yaw: float = 0.04
