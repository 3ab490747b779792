"""Electrical power: the published run times that the losses are fitted to, and laws of motors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robot.model.power import HOTEL_LOAD, electrical_power, motor_power, typical_motor_power

twelve = arrays(np.float64, 12, elements=st.floats(-100.0, 100.0))
speeds = st.floats(-2.0, 2.0)


@given(twelve, twelve)
def test_motors_take_their_positive_work_and_their_heat_joint_by_joint(torque: np.ndarray, speed: np.ndarray) -> None:
    by_hand = sum(max(t * w, 0.0) + 0.053 * t * t for t, w in zip(torque.tolist(), speed.tolist(), strict=True))
    assert motor_power(torque, speed) == pytest.approx(by_hand, rel=1e-12, abs=1e-12)


@given(twelve, twelve)
def test_braking_gives_nothing_back_and_the_sign_of_both_makes_no_difference(
    torque: np.ndarray, speed: np.ndarray
) -> None:
    assert motor_power(torque, speed) >= motor_power(torque, np.zeros(12)) - 1e-9
    assert motor_power(-torque, -speed) == pytest.approx(motor_power(torque, speed))
    both = motor_power(torque, speed) + motor_power(torque, -speed)
    heat = 2 * 0.053 * float(torque @ torque)
    assert both == pytest.approx(float(np.abs(torque * speed).sum()) + heat)


def test_the_battery_of_605_wh_lasts_180_min_standing_by_and_90_in_typical_use() -> None:
    """What the losses are fitted to: standing takes 202 W, and 403 W are a walk at 0.9 m/s."""
    standing = electrical_power(typical_motor_power(0.0, 0.0, 0.0, walking=False))
    assert 605.0 / standing * 60.0 == pytest.approx(180.0, rel=0.01)
    walking = electrical_power(typical_motor_power(0.9, 0.0, 0.0, walking=True))
    assert 605.0 / walking * 60.0 == pytest.approx(90.0, rel=0.02)


@given(vx=speeds, vy=speeds, wz=speeds)
def test_walking_costs_by_the_length_of_the_velocity_with_turning_as_43_cm(vx: float, vy: float, wz: float) -> None:
    straight = typical_motor_power(float(np.linalg.norm((vx, vy, 0.43 * wz))), 0.0, 0.0, walking=True)
    assert typical_motor_power(vx, vy, wz, walking=True) == pytest.approx(straight)
    assert typical_motor_power(vx, vy, wz, walking=False) == 82.0


@given(a=st.floats(0.0, 3.0), b=st.floats(0.0, 3.0))
def test_faster_never_costs_less_and_beyond_the_table_it_stays(a: float, b: float) -> None:
    slow, fast = sorted((a, b))
    at = [typical_motor_power(speed, 0.0, 0.0, walking=True) for speed in (slow, fast, 1.6)]
    assert at[0] <= at[1] <= at[2]


@given(st.floats(0.0, 500.0), st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_everything_that_is_switched_on_is_added(motor: float, arm: float, payload: float) -> None:
    assert electrical_power(motor, arm=arm, payload=payload) == pytest.approx(motor + arm + payload + 120.0)
    assert HOTEL_LOAD == 120.0
