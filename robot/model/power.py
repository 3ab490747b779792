"""Electrical power of the robot from what its motors do, and the typical power of walking where no torque is simulated.

    P = sum(max(tau qd, 0)) + k_cu sum(tau^2) + hotel + arm + payload

k_cu and the hotel load (computers, sensors, radio) are fitted to two published run times: 605 Wh last 180 min
standing by and 90 min in typical use (docs/concepts/control.md#power-and-battery). Other robots take what is alike for their mass and size: with the ratios
M of masses and L of legs, the power of motors goes with M sqrt(L), and the hotel load with M.
"""

from __future__ import annotations

import math

import numpy as np

from robot.geometry.vectors import Vector
from robot.model.robot import SPOT, RobotModel

HOUR = 3600.0
"""s."""
HOTEL_LOAD = 120.0
"""W, drawn as long as the robot is switched on."""
COPPER_LOSS = 0.053
"""k_cu, W/(N m)^2."""

_SPEED = (0.0, 0.3, 0.6, 1.0, 1.3, 1.6)
_WALKING = (202.0, 210.0, 240.0, 304.0, 366.0, 441.0)
STANDING = 82.0
TURNING_ARM = 0.43
"""Metres that turn a yaw rate into the forward speed that costs as much."""


def copper_loss(model: RobotModel) -> float:
    """k_cu of a robot, W/(N m)^2."""
    return COPPER_LOSS / model.damper


def motor_power(torque: Vector, speed: Vector, loss: float = COPPER_LOSS) -> float:
    """Electrical power of motors, W, for torques (N m) and speeds (rad/s), shape (n,), by their copper `loss`. Braking gives nothing back."""
    return float(np.maximum(torque * speed, 0.0).sum() + loss * torque.dot(torque))


def electrical_power(motor: float, *, arm: float = 0.0, payload: float = 0.0, model: RobotModel = SPOT) -> float:
    """What the battery must deliver, W: motors, hotel load, arm and payload."""
    return motor + HOTEL_LOAD * model.force + arm + payload


def typical_motor_power(vx: float, vy: float, wz: float, *, walking: bool, model: RobotModel = SPOT) -> float:
    """Motor power of the trot, W, without hotel load, for a body that simulates no torque.

    Speeds in m/s and rad/s. From the measured table of total power over forward speed (202 W standing, 330 at 0.3,
    360 at 0.6, 424 at 1.0, 486 at 1.3, 561 at 1.6 m/s), linear between and constant beyond. Stepping in place is
    taken 8 W below 0.3 m/s and turning counts as 0.43 m/s per rad/s: both from the measured mechanical power of the
    same gait.
    """
    scale = model.force * model.speed
    if not walking:
        return STANDING * scale
    alike = math.hypot(vx, vy, TURNING_ARM * model.length * wz) / model.speed
    return scale * float(np.interp(alike, _SPEED, _WALKING))
