"""The motor targets of one control step, filled leg by leg in plain floats."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robot.geometry.vectors import Rows, Triple
from robot.hardware.body import MotorTargets

FASTEST = 15.0
"""Bound of a joint speed that may be asked for, rad/s."""
SINGULAR = 1e-5
"""A Jacobian whose determinant (m3) is smaller in magnitude tells no joint speeds: the leg is stretched, or folded; chosen."""


class Targets:
    """Collects position, velocity, effort and gains of 12 joints. Unset joints are free: no torque."""

    __slots__ = ("effort", "kd", "kp", "position", "velocity")

    def __init__(self) -> None:
        self.position = [0.0] * 12
        self.velocity = [0.0] * 12
        self.effort = [0.0] * 12
        self.kp = [0.0] * 12
        self.kd = [0.0] * 12

    def leg(
        self,
        leg: int,
        *,
        effort: Sequence[float],
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        position: Sequence[float] = (0.0, 0.0, 0.0),
        kp: float = 0.0,
        kd: float = 0.0,
    ) -> None:
        """Set the three joints of one leg."""
        joints = slice(3 * leg, 3 * leg + 3)
        self.effort[joints] = effort
        self.velocity[joints] = velocity
        self.position[joints] = position
        self.kp[joints] = (kp, kp, kp)
        self.kd[joints] = (kd, kd, kd)

    def freeze(self) -> MotorTargets:
        """The message for the motor drives."""
        return MotorTargets(
            position=np.array(self.position),
            velocity=np.array(self.velocity),
            effort=np.array(self.effort),
            kp=np.array(self.kp),
            kd=np.array(self.kd),
        )


def joint_speeds(jacobian: Rows, x: float, y: float, z: float) -> Triple:
    """The joint speeds J^-1 (x, y, z) of one leg, each clipped to 15 rad/s; zero where the leg is singular."""
    (_, xb, xc), (ya, yb, yc), (za, zb, zc) = jacobian
    determinant = -xb * (ya * zc - yc * za) + xc * (ya * zb - yb * za)
    if abs(determinant) < SINGULAR:
        return (0.0, 0.0, 0.0)
    scale = 1.0 / determinant
    a = (x * (yb * zc - yc * zb) - xb * (y * zc - yc * z) + xc * (y * zb - yb * z)) * scale
    b = (x * (yc * za - ya * zc) + xc * (ya * z - y * za)) * scale
    c = (-xb * (ya * z - y * za) + x * (ya * zb - yb * za)) * scale
    return (_clip(a), _clip(b), _clip(c))


def _clip(speed: float) -> float:
    return max(-FASTEST, min(FASTEST, speed))
