"""A body that moves over standing feet: the truth by which the estimators are judged.

The leg is written as a chain of scipy's rotations, and its Jacobian by the rule that a joint moves the foot by its axis x the arm to it: neither
uses the robot's closed forms.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from robot.geometry.vectors import Floats, Rows
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import inverse
from robot.model.parameters import ABDUCTION, CALF, FOOT_RADIUS, GRAVITY, HIPS, SIDES, THIGH
from robot.model.stance import nominal_feet

ALL = (True, True, True, True)
HEIGHT = 0.5
"""Of the hips over the foot centres when a motion begins, m."""


def rows_of(rotation: Rotation) -> Rows:
    first, second, third = (tuple(row) for row in rotation.as_matrix().tolist())
    return (first, second, third)


def joints(angles: Floats, speeds: Floats | None = None, contact: Sequence[bool] = ALL) -> JointSample:
    return JointSample(angles, np.zeros(12) if speeds is None else speeds, np.zeros(12), np.array(contact))


def standing(height: float = HEIGHT, contact: Sequence[bool] = ALL) -> JointSample:
    """A robot at rest with straight legs below its shoulders."""
    return joints(inverse(nominal_feet(height)).joints, contact=contact)


def at_rest(rotation: Rotation | None = None) -> ImuSample:
    """What an IMU shows in a body that does not move."""
    up = np.array((0.0, 0.0, GRAVITY))
    return ImuSample(np.zeros(3), up if rotation is None else rotation.inv().apply(up))


def leg(number: int, angles: Floats) -> tuple[Floats, Floats, Floats]:
    """The foot's centre and its Jacobian in body axes, and the axes about which the calf turns, (3, 3) by columns."""
    q1, q2, q3 = angles[3 * number : 3 * number + 3]
    hip = np.array((*HIPS[number], 0.0))
    about_hip = Rotation.from_euler("x", q1)
    across = about_hip.apply((0.0, 1.0, 0.0))
    shoulder = hip + about_hip.apply((0.0, SIDES[number] * ABDUCTION, 0.0))
    knee = shoulder + (about_hip * Rotation.from_euler("y", q2)).apply((0.0, 0.0, -THIGH))
    foot = knee + (about_hip * Rotation.from_euler("y", q2 + q3)).apply((0.0, 0.0, -CALF))
    axes = np.array(((1.0, 0.0, 0.0), across, across)).T
    arms = np.array((foot - hip, foot - shoulder, foot - knee)).T
    return foot, np.cross(axes.T, arms.T).T, axes


class Swaying:
    """A body whose velocity (odom axes) and turning (body axes) are told, over four feet that roll and do not slide."""

    def __init__(self) -> None:
        self.position = np.array((0.0, 0.0, HEIGHT + FOOT_RADIUS))
        self.velocity = np.zeros(3)
        self.rotation = Rotation.identity()
        self.turn = np.zeros(3)
        self.angles = inverse(nominal_feet(HEIGHT)).joints

    @property
    def speeds(self) -> Floats:
        """Joint speeds with which every foot's centre has the velocity of a ball that rolls on the floor, shape (12,)."""
        up = FOOT_RADIUS * self.rotation.inv().apply((0.0, 0.0, 1.0))
        through = self.rotation.inv().apply(self.velocity)
        found = []
        for number in range(4):
            foot, jacobian, axes = leg(number, self.angles)
            rolled = np.cross(axes.T, up).T
            wanted = np.cross(self.turn, up) - np.cross(self.turn, foot) - through
            found.append(np.linalg.solve(jacobian - rolled, wanted))
        return np.concatenate(found)

    def move(self, dt: float, velocity: Floats, turn: Floats) -> None:
        """Go on for `dt` seconds to another velocity and turning: the middle of the step is where its slopes are taken."""
        acceleration = (velocity - self.velocity) / dt
        self.velocity, self.turn = self.velocity + acceleration * dt / 2, (self.turn + turn) / 2
        angles, rotation, position = self.angles, self.rotation, self.position
        self.angles = angles + self.speeds * dt / 2
        self.rotation = rotation * Rotation.from_rotvec(self.turn * dt / 2)
        self.angles = angles + self.speeds * dt
        self.rotation = rotation * Rotation.from_rotvec(self.turn * dt)
        self.position = position + self.velocity * dt
        self.velocity, self.turn = velocity, turn

    def imu(self, acceleration: Floats) -> ImuSample:
        """What an IMU without noise shows; `acceleration` in odom axes."""
        return ImuSample(self.turn, self.rotation.inv().apply(acceleration + np.array((0.0, 0.0, GRAVITY))))
