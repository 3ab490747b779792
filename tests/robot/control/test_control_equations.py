"""Equations of docs/control.md that the code solves in another form than they are written there: both forms give the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from robot.estimation.leg_odometry import (
    ACCEL_NOISE,
    DOUBT,
    LANDING_NOISE,
    PLACE_NOISE,
    SETTLING,
    SLIDE_NOISE,
    SPEED_NOISE,
    Estimator,
)
from robot.geometry.vectors import Floats, Triple
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import inverse
from robot.model.parameters import GRAVITY
from robot.model.stance import nominal_feet

HEIGHT = 0.5
LEVEL = np.array((0.0, 0.0, GRAVITY))


def still(contact: Sequence[bool] = (True,) * 4) -> JointSample:
    """A robot that stands at rest with these feet on the ground."""
    angles = inverse(nominal_feet(HEIGHT)).joints
    return JointSample(angles, np.zeros(12), np.zeros(12), np.array(contact))


def cross(arm: Triple) -> Floats:
    x, y, z = arm
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def test_the_covariance_of_the_leg_odometry_is_that_of_a_kalman_filter_in_matrices() -> None:
    """Three feet stand from the first sample on, the fourth never does. Told by the deviations of position and velocity."""
    dt = 0.005
    estimate, imu, joints = Estimator(), ImuSample(np.zeros(3), LEVEL), still((True, True, True, False))
    f = np.eye(6)
    f[0, 1] = dt
    q = dt * np.diag((0.0, ACCEL_NOISE**2, *(4 * (SLIDE_NOISE**2,))))
    p, standing_for = np.diag((1e-6, *(5 * (1e-4,)))), 0.0
    for step in range(100):
        estimate.update(dt, imu, joints)
        p = f @ p @ f.T + q
        for foot in (2, 3, 4) if step == 0 else ():
            p[foot], p[:, foot] = p[0], p[:, 0]
            p[foot, foot] = p[0, 0] + LANDING_NOISE**2
        standing_for += dt
        doubt = DOUBT if standing_for < SETTLING else 1.0
        for foot in (2, 3, 4):
            place, speed = np.zeros(6), np.zeros(6)
            place[foot], place[0], speed[1] = 1.0, -1.0, 1.0
            for h, density in ((place, PLACE_NOISE), (speed, SPEED_NOISE)):
                p -= np.outer(p @ h, h @ p) / (h @ p @ h + doubt * density**2 / dt)
        assert estimate.deviation == pytest.approx((p[0, 0] ** 0.5, p[1, 1] ** 0.5), rel=1e-9)
