"""What the feet tell of the body's own acceleration, which the attitude filter subtracts before it looks for gravity."""

from __future__ import annotations

import numpy as np
import pytest

from robot.estimation.leg_odometry import OWN_ACCEL_TIME, Estimator
from robot.hardware.body import ImuSample, JointSample
from robot.model.parameters import FOOT_RADIUS, GRAVITY
from tests.robot.estimation.stance import ALL, at_rest, joints, leg, standing

NONE = (False,) * 4


def running(speed: float, contact: tuple[bool, ...] = ALL) -> JointSample:
    """Feet that move backward under a level body as those of one that goes forward at so many m/s."""
    angles = standing().position
    speeds = np.empty(12)
    for number in range(4):
        _, jacobian, axes = leg(number, angles)
        rolled = np.cross(axes.T, (0.0, 0.0, FOOT_RADIUS)).T
        speeds[3 * number : 3 * number + 3] = np.linalg.solve(jacobian - rolled, (-speed, 0.0, 0.0))
    return joints(angles, speeds, contact)


@pytest.mark.parametrize("hz", [100, 200, 500])
def test_it_comes_up_to_the_feets_acceleration_with_the_time_constant_of_a_low_pass(hz: int) -> None:
    estimate, imu = Estimator(), ImuSample(np.zeros(3), np.array((1.5, 0.0, GRAVITY)))
    estimate.update(1.0 / hz, at_rest(), running(0.0))
    for step in range(1, round(0.3 * hz) + 1):
        estimate.update(1.0 / hz, imu, running(1.5 * step / hz))
    assert estimate.own_acceleration[0] == pytest.approx(1.5 * (1.0 - np.exp(-0.3 / OWN_ACCEL_TIME)), rel=0.02)
    assert estimate.own_acceleration[1:] == pytest.approx((0.0, 0.0), abs=0.02)


def test_a_steady_walk_has_none() -> None:
    estimate = Estimator()
    for _ in range(400):
        estimate.update(0.005, at_rest(), running(0.8))
    assert estimate.own_acceleration == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize("hz", [100, 200, 500])
def test_after_a_flight_at_constant_speed_the_acceleration_before_it_does_not_come_back(hz: int) -> None:
    """The flight of a bound or a pronk. The low-pass has to go on meanwhile, as if the feet still showed their last velocity."""
    estimate, dt = Estimator(), 1.0 / hz
    for step in range(1, round(0.3 * hz) + 1):
        estimate.update(dt, at_rest(), running(2.0 * step / hz))
    before = estimate.own_acceleration[0]
    for _ in range(round(0.15 * hz)):
        estimate.update(dt, at_rest(), running(0.0, NONE))
    in_flight = estimate.own_acceleration[0]
    estimate.update(dt, at_rest(), running(0.6))
    assert before == pytest.approx(2.0 * (1.0 - np.exp(-2.0)), rel=0.02)
    assert in_flight == pytest.approx(before * np.exp(-0.15 / OWN_ACCEL_TIME), rel=1e-6)
    assert estimate.own_acceleration[0] == pytest.approx(in_flight * np.exp(-dt / OWN_ACCEL_TIME), rel=1e-3)


def test_only_the_feet_that_stand_are_asked() -> None:
    estimate, swinging = Estimator(), running(-3.0)
    estimate.update(0.005, at_rest(), standing())
    for step in range(1, 21):
        sample = running(0.01 * step, (True, False, False, True))
        sample.velocity[3:9] = swinging.velocity[3:9]
        estimate.update(0.005, ImuSample(np.zeros(3), np.array((2.0, 0.0, GRAVITY))), sample)
    assert estimate.own_acceleration[0] == pytest.approx(2.0 * (1.0 - np.exp(-0.1 / OWN_ACCEL_TIME)), rel=0.01)
