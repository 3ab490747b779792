"""Joints that chase their targets, and where rolling feet push a body, against the integrated truth of a swaying one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.hardware.body import MotorTargets
from robot.model.robot import SPOT
from robot.sim.following import chase, pushed_body
from tests.robot.estimation.stance import HEIGHT, Swaying

speed = st.floats(-0.8, 0.8)


def targets(position: float = 0.0, velocity: float = 0.0, kp: float = 100.0) -> MotorTargets:
    return MotorTargets(*(np.full(12, value) for value in (position, velocity, 0.0, kp, 5.0)))


@given(position=st.floats(-1.0, 1.0), velocity=st.floats(-5.0, 5.0), at=st.floats(-1.0, 1.0))
def test_a_joint_goes_at_the_speed_it_is_told_and_fifty_times_its_error(
    position: float, velocity: float, at: float
) -> None:
    assert chase(np.full(12, at), targets(position, velocity)) == pytest.approx(
        np.full(12, velocity + 50.0 * (position - at))
    )


def test_followed_in_small_steps_it_arrives_with_a_time_constant_of_20_ms() -> None:
    joints = np.zeros(12)
    for _ in range(2000):
        joints = joints + 1e-5 * chase(joints, targets(1.0))
    assert joints == pytest.approx(np.full(12, 1.0 - np.exp(-1.0)), rel=1e-3)


def test_a_joint_without_gain_has_nothing_to_follow() -> None:
    gains = np.array([0.0, 1.0] * 6)
    told = MotorTargets(np.ones(12), np.ones(12), np.zeros(12), gains, np.zeros(12))
    assert chase(np.zeros(12), told).tolist() == [0.0, 51.0] * 6


@settings(deadline=None, max_examples=30)
@given(vx=speed, vy=speed, wz=speed)
def test_feet_that_roll_push_the_body_as_it_must_have_moved(vx: float, vy: float, wz: float) -> None:
    """The joint speeds are those of a body that goes there over feet that roll and do not slide."""
    truth = Swaying()
    truth.velocity, truth.turn = np.array((vx, vy, 0.0)), np.array((0.0, 0.0, wz))
    pushed = pushed_body(truth.angles, truth.speeds, SPOT)
    assert (pushed.twist.vx, pushed.twist.vy, pushed.twist.wz) == pytest.approx((vx, vy, wz), abs=1e-9)
    assert pushed.height == pytest.approx(HEIGHT)
    assert pushed.contact == [True] * 4


@given(lift=st.floats(0.006, 0.1), foot=st.integers(0, 3))
def test_a_lifted_foot_neither_stands_nor_pushes(lift: float, foot: int) -> None:
    truth = Swaying()
    truth.velocity = np.array((0.3, 0.1, 0.0))
    speeds, angles = truth.speeds, truth.angles.copy()
    angles[3 * foot + 2] -= 8 * lift
    speeds[3 * foot : 3 * foot + 3] = (5.0, -7.0, 3.0)
    pushed = pushed_body(angles, speeds, SPOT)
    assert pushed.contact == [leg != foot for leg in range(4)]
    assert (pushed.twist.vx, pushed.twist.vy, pushed.twist.wz) == pytest.approx((0.3, 0.1, 0.0), abs=1e-9)


def test_feet_that_disagree_push_by_least_squares() -> None:
    truth, parts = Swaying(), []
    for vx in (0.2, 0.4):
        truth.velocity = np.array((vx, 0.0, 0.0))
        parts.append(truth.speeds)
    mixed = np.where(np.repeat([True, False, True, False], 3), *parts)
    pushed = pushed_body(truth.angles, mixed, SPOT)
    left = np.array([y for _, y in ((0.29785, 0.1658), (0.29785, -0.1658))])
    arms = 0.29785**2 + left[0] ** 2
    assert pushed.twist.vx == pytest.approx(0.3)
    assert pushed.twist.wz == pytest.approx(0.1 * left[0] / arms, rel=1e-3), "the right feet are faster: it turns left"


def test_a_body_that_leans_is_none_of_its_business() -> None:
    """It takes the body as level: the feet's places alone say which of them stand."""
    truth = Swaying()
    truth.rotation = Rotation.from_euler("x", 0.2)
    assert pushed_body(truth.angles, np.zeros(12), SPOT).twist.vx == 0.0
