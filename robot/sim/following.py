"""Joints that chase their targets, and where that pushes the body when feet stick to the floor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robot.geometry.planar import Twist2
from robot.geometry.vectors import Vector
from robot.hardware.body import MotorTargets
from robot.model.legs import foot_velocities, leg_state
from robot.model.robot import RobotModel

SERVO = 50.0
"""Gain with which joints follow commanded positions, 1/s."""
STANDING_BAND = 0.004
"""Feet of the reference body at most this much above the lowest one stand, m."""


class Pushed(NamedTuple):
    """What the joints' motion does to a level body on a flat floor."""

    twist: Twist2
    """Forward, left (m/s), turning (rad/s)."""
    height: float
    """Hip plane above the standing feet's centres, m."""
    contact: list[bool]


def chase(joints: Vector, targets: MotorTargets) -> Vector:
    """Joint speeds (rad/s), shape (12,), towards the targets: commanded speed plus 50 times the position error.

    Joints without position gain have nothing to follow and stay.
    """
    speeds = targets.velocity + SERVO * (targets.position - joints)
    return np.where(targets.kp > 0.0, speeds, 0.0)


def pushed_body(joints: Vector, speeds: Vector, model: RobotModel) -> Pushed:
    """The body motion that lets standing feet roll but not slide: v + w x p = roll - J qd for each, by least squares."""
    angles, up = joints.tolist(), (0.0, 0.0, 1.0)
    now = leg_state(angles, up, model)
    moving, rolling = foot_velocities(now, angles, speeds.tolist(), (0.0, 0.0, 0.0), up)
    lowest = min(z for _, _, z in now.feet)
    contact = [z < lowest + STANDING_BAND * model.length for _, _, z in now.feet]
    rows: list[tuple[float, float, float]] = []
    wanted: list[float] = []
    for leg, (x, y, _) in enumerate(now.feet):
        if contact[leg]:
            rows += [(1.0, 0.0, -y), (0.0, 1.0, x)]
            wanted += [rolling[leg][axis] - moving[leg][axis] for axis in (0, 1)]
    vx, vy, wz = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0].tolist()
    height = -sum(z for (_, _, z), stands in zip(now.feet, contact, strict=True) if stands) / sum(contact)
    return Pushed(Twist2(vx, vy, wz), height, contact)
