"""The sample of an IMU that is not there, by the standing feet: their motion against the body is the body's own, and four span the ground.

Equations: docs/control.md#without-an-imu.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from robot.estimation.terrain import plane
from robot.geometry.vectors import Rows, Triple, Vector, to_body
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LegState, foot_velocities
from robot.model.parameters import GRAVITY

__all__ = ["virtual_imu"]

CATCH_UP = 0.05
"""Time constant (s) with which the attitude is brought to what four standing feet show."""
FASTEST = 2.0
"""rad/s; feet that bounce or slip show more."""
UNSEEN = 1e-3
"""Tikhonov term of the least squares, m2: with two feet the turn about the line between them cannot be observed."""


def virtual_imu(legs: LegState, joints: JointSample, rotation: Rows, slope: tuple[float, float]) -> ImuSample:
    """The sample of an IMU in a body that is at rest on its standing feet but for turning, as those show it.

    Without standing feet the attitude is kept. With four it is also brought to the one that the ground asks for: `slope` is the
    ground's as it is known, rise per metre along odom x and y, and `rotation` the attitude as it is believed, body to odom.
    """
    up = rotation[2]
    standing = joints.contact.tolist()
    turn = _turning(legs, joints, standing, up) if sum(standing) > 1 else np.zeros(3)
    if all(standing) and (shown := _vertical(legs.feet, slope, rotation)) is not None:
        turn = turn + np.cross(shown, up) / CATCH_UP
        up = shown
    return ImuSample(np.clip(turn, -FASTEST, FASTEST), GRAVITY * np.array(up))


def _turning(legs: LegState, joints: JointSample, standing: Sequence[bool], up: Triple) -> Vector:
    """The angular velocity (body axes, rad/s) with which the body turns over its standing feet, two at least; least squares."""
    moving, rolling = foot_velocities(legs, joints.position.tolist(), joints.velocity.tolist(), (0.0, 0.0, 0.0), up)
    feet, speeds = np.array(legs.feet)[standing], (np.array(moving) - np.array(rolling))[standing]
    arms, ways = feet - feet.mean(axis=0), speeds - speeds.mean(axis=0)
    # Of feet that do not move in the world, each way is its arm x the turn.
    matrix: Vector = (float(np.sum(arms * arms)) + UNSEEN) * np.eye(3) - arms.T @ arms
    moments: Vector = np.asarray(np.cross(ways, arms), dtype=np.float64)
    return np.asarray(np.linalg.solve(matrix, moments.sum(axis=0)), dtype=np.float64)


def _vertical(feet: Sequence[Triple], slope: tuple[float, float], rotation: Rows) -> Triple | None:
    """The world's vertical in body axes, from the feet (body axes, m) of a robot that stands on all four; None if they cannot tell."""
    _, lies = plane(feet)
    if lies is None:
        return None
    normal = _unit((-lies[0], -lies[1], 1.0))
    ground = _unit((-slope[0], -slope[1], 1.0))
    lean = to_body(rotation, (-ground[0], -ground[1], 1.0 - ground[2]))
    return _unit((normal[0] + lean[0], normal[1] + lean[1], normal[2] + lean[2]))


def _unit(vector: Triple) -> Triple:
    x, y, z = vector
    length = sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)
