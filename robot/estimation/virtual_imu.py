"""The sample of an IMU that is not there, by the standing feet: their motion against the body is the body's own, and they are on the ground.

Equations: docs/concepts/control.md#without-an-imu.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robot.geometry.vectors import Rows, Triple, Vector, to_body
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LegState, foot_velocities
from robot.model.parameters import GRAVITY

CATCH_UP = 0.05
"""Time constant (s) with which the attitude is brought to what four standing feet show."""
FASTEST = 2.0
"""rad/s; feet that bounce or slip show more."""
UNSEEN = 1e-3
"""Tikhonov term of the least squares, m2: with two feet the turn about the line between them cannot be observed."""
IN_LINE = 1e-6
"""The same of what they tell of the vertical, m2."""


def virtual_imu(legs: LegState, joints: JointSample, rotation: Rows, slope: tuple[float, float]) -> ImuSample:
    """The sample of an IMU in a body that is at rest on its standing feet but for turning, as those show it.

    Without two standing feet the attitude is kept. With them it is also brought to the one that the ground asks for, as far as they tell: `slope` is
    the ground's as it is known, rise per metre along odom x and y, and `rotation` the attitude as it is believed, body to odom.
    """
    up = np.array(rotation[2])
    standing = joints.contact.tolist()
    if sum(standing) < 2:
        return ImuSample(np.zeros(3), GRAVITY * up)
    shown = _vertical(np.array(legs.feet)[standing], slope, rotation)
    turn = _turning(legs, joints, standing, rotation[2]) + np.cross(shown, up) / CATCH_UP
    return ImuSample(np.clip(turn, -FASTEST, FASTEST), GRAVITY * shown)


def _turning(legs: LegState, joints: JointSample, standing: Sequence[bool], up: Triple) -> Vector:
    """The angular velocity (body axes, rad/s) with which the body turns over its standing feet, two at least; least squares."""
    moving, rolling = foot_velocities(legs, joints.position.tolist(), joints.velocity.tolist(), (0.0, 0.0, 0.0), up)
    feet, speeds = np.array(legs.feet)[standing], (np.array(moving) - np.array(rolling))[standing]
    arms, ways = feet - feet.mean(axis=0), speeds - speeds.mean(axis=0)
    # Of feet that do not move in the world, each way is its arm x the turn.
    matrix: Vector = (float(np.sum(arms * arms)) + UNSEEN) * np.eye(3) - arms.T @ arms
    moments: Vector = np.asarray(np.cross(ways, arms), dtype=np.float64)
    return np.asarray(np.linalg.solve(matrix, moments.sum(axis=0)), dtype=np.float64)


def _vertical(feet: Vector, slope: tuple[float, float], rotation: Rows) -> Vector:
    """The world's vertical in body axes, by standing feet (body axes, m, shape (n, 3)) that are on the ground; least squares.

    About the line through two feet it stays where it is believed to be.
    """
    up = np.array(rotation[2])
    normal = np.array(to_body(rotation, (-slope[0], -slope[1], 1.0)))
    arms = feet - feet.mean(axis=0)
    # An attitude that is off by d shows each foot off the plane by arm . normal = -d . (normal x arm).
    across: Vector = np.asarray(np.cross(normal, arms), dtype=np.float64)
    matrix: Vector = across.T @ across + IN_LINE * np.eye(3)
    off: Vector = np.asarray(np.linalg.solve(matrix, -(across.T @ (arms @ normal))), dtype=np.float64)
    shown = up + np.cross(off, up)
    return np.asarray(shown / np.linalg.norm(shown), dtype=np.float64)
