"""Equations of docs/control.md that the code solves in another form than they are written there: both forms give the same."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from robot.control.balance import EFFORT, IMPORTANCE, distribute
from robot.control.rollout import rollout
from robot.control.sway import sway
from robot.control.walk_config import WalkConfig
from robot.control.walk_law import AT_REST, Step, foothold
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
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, Triple
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import inverse
from robot.model.mass import standing_mass
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


@pytest.mark.parametrize("legs", [(0, 1, 2, 3), (0, 1, 2), (0, 3)])
def test_the_dual_form_of_the_force_distribution_minimises_the_cost(legs: tuple[int, ...]) -> None:
    feet = nominal_feet(HEIGHT)
    arms: list[Triple] = [(float(feet[leg][0]) - 0.06, float(feet[leg][1]) - 0.03, -0.48) for leg in legs]
    wrench = np.array((10.0, -5.0, 300.0, 2.0, -3.0, 1.0))
    a = np.hstack([np.vstack((np.eye(3), cross(arm))) for arm in arms])
    weights = np.diag(IMPORTANCE)
    wanted = np.linalg.solve(a.T @ weights @ a + EFFORT * np.eye(3 * len(legs)), a.T @ weights @ wrench)
    forces = distribute(arms, wrench.tolist())
    assert np.array(forces).ravel() == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("turn", [-1.0, 0.5])
def test_a_turn_moves_the_foothold_outwards_by_v_cross_w(turn: float) -> None:
    def landing(rate: float) -> Floats:
        estimate = Estimator()
        estimate.update(0.005, ImuSample(np.zeros(3), LEVEL), still())
        ahead = PredictedState(estimate, still(), 0.0, (0.0, 0.0, 0.0))
        ahead.velocity = (0.8, 0.3, 0.0)
        rest = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        step = Step(0.005, ahead, TerrainPlane(), (0.8, 0.3), rate, rest, HEIGHT, standing_mass(HEIGHT))
        return np.array(foothold(WalkConfig(), AT_REST, step, 0, 0.0, 0.0))

    wanted = HEIGHT / (2.0 * GRAVITY) * np.cross((0.8, 0.3, 0.0), (0.0, 0.0, turn))
    assert landing(turn) - landing(0.0) == pytest.approx(wanted, abs=1e-12)


def test_the_sway_is_the_motion_of_a_linear_inverted_pendulum() -> None:
    """For a balance point whose series has the three harmonics that are used."""
    period, reach, change, height = 1.0, 0.06, 0.1, 0.5
    for phase in np.linspace(0.0, 1.0, 41):
        place, _, push = sway(float(phase), period, reach, change, height)
        balance = sum(
            4.0 * reach / (math.pi * k) * np.sinc(k * change) * math.sin(math.tau * k * phase) for k in (1, 3, 5)
        )
        assert push == pytest.approx(GRAVITY / height * (place - balance), abs=1e-12)


def test_a_constant_command_leads_along_the_integral_of_its_velocity() -> None:
    command = np.array([[0.6, -0.2, 0.9]])
    x, y, yaw = (float(value[0, 0]) for value in rollout(Pose2(1.0, 2.0, 0.3), command, np.array([1.2])))
    steps = 200_000
    angles = 0.3 + 0.9 * (np.arange(steps) + 0.5) * 1.2 / steps
    dt = 1.2 / steps
    assert x == pytest.approx(1.0 + float((0.6 * np.cos(angles) + 0.2 * np.sin(angles)).sum()) * dt, abs=1e-9)
    assert y == pytest.approx(2.0 + float((0.6 * np.sin(angles) - 0.2 * np.cos(angles)).sum()) * dt, abs=1e-9)
    assert yaw == pytest.approx(0.3 + 0.9 * 1.2)


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
