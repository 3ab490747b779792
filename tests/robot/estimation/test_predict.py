"""The state at the moment the motors act, against closed forms and scipy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.geometry.vectors import Triple
from robot.hardware.body import JointSample
from tests.robot.estimation.stance import joints, leg, rows_of, standing

vectors = st.tuples(*(st.floats(-2.0, 2.0) for _ in range(3)))
leads = st.floats(0.0, 0.02)
ATTITUDE = Rotation.from_euler("ZYX", (0.7, -0.1, 0.2))


def estimated(velocity: Triple = (0.0, 0.0, 0.0), turn: Triple = (0.0, 0.0, 0.0)) -> Estimator:
    estimate = Estimator()
    estimate.position, estimate.velocity = (1.0, -2.0, 0.5), velocity
    estimate.rotation, estimate.attitude.turn = rows_of(ATTITUDE), turn
    return estimate


@given(velocity=vectors, acceleration=vectors, lead=leads)
def test_the_body_falls_along_a_parabola(velocity: Triple, acceleration: Triple, lead: float) -> None:
    ahead = PredictedState(estimated(velocity), standing(), lead, acceleration)
    v, a = np.array(velocity), np.array(acceleration)
    assert ahead.position == pytest.approx((1.0, -2.0, 0.5) + v * lead + a * lead**2 / 2)
    assert ahead.velocity == pytest.approx(v + a * lead)
    assert ahead.lead == lead


@given(turn=vectors, lead=leads)
def test_the_rotation_is_that_of_a_constant_turning_to_first_order(turn: Triple, lead: float) -> None:
    ahead = PredictedState(estimated(turn=turn), standing(), lead, (0.0, 0.0, 0.0))
    exact = ATTITUDE * Rotation.from_rotvec(np.array(turn) * lead)
    second_order = (np.linalg.norm(turn) * lead) ** 2 / 2
    assert np.abs(np.array(ahead.rotation) - exact.as_matrix()).max() <= second_order + 1e-12
    yaw, pitch, roll = exact.as_euler("ZYX")
    assert (ahead.yaw, ahead.pitch, ahead.roll) == pytest.approx((yaw, pitch, roll), abs=2 * second_order + 1e-9)
    assert ahead.turn == turn


def test_at_two_rad_per_s_and_ten_ms_the_rotation_is_off_by_the_2e_4_that_the_manual_states() -> None:
    ahead = PredictedState(estimated(turn=(0.0, 2.0, 0.0)), standing(), 0.01, (0.0, 0.0, 0.0))
    exact = ATTITUDE * Rotation.from_rotvec((0.0, 0.02, 0.0))
    assert np.abs(np.array(ahead.rotation) - exact.as_matrix()).max() == pytest.approx(2e-4, rel=0.1)


@given(seed=st.integers(0, 1000), lead=leads)
def test_the_legs_go_on_at_the_speed_of_their_joints(seed: int, lead: float) -> None:
    random = np.random.default_rng(seed)
    now: JointSample = joints(standing().position + random.normal(0.0, 0.1, 12), random.normal(0.0, 3.0, 12))
    ahead = PredictedState(estimated(turn=(0.3, 0.2, -1.0)), now, lead, (0.0, 0.0, 0.0))
    angles = now.position + now.velocity * lead
    assert ahead.angles == pytest.approx(angles.tolist())
    for number in range(4):
        foot, jacobian, _ = leg(number, angles)
        assert ahead.legs.feet[number] == pytest.approx(foot)
        assert np.array(ahead.legs.jacobians[number]) == pytest.approx(jacobian)
        assert ahead.feet[number] == pytest.approx(np.array(ahead.rotation) @ foot)


def test_two_short_leads_are_one_long_one_in_place_and_velocity() -> None:
    acceleration = (1.0, -2.0, 3.0)
    halfway = PredictedState(estimated((0.4, 0.1, -0.2)), standing(), 0.004, acceleration)
    between = estimated(halfway.velocity)
    between.position = halfway.position
    there = PredictedState(between, standing(), 0.006, acceleration)
    once = PredictedState(estimated((0.4, 0.1, -0.2)), standing(), 0.010, acceleration)
    assert there.position == pytest.approx(once.position)
    assert there.velocity == pytest.approx(once.velocity)
