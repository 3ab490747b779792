"""What an IMU at rest tells: the bias as exactly as its noise allows, and nothing when the robot was not at rest."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from robot.estimation.rest import AT_REST, NotAtRest, rest_of
from robot.sim.noise import ImuNoise

STILL = [0.003] * 100
NO_TURN = [0.001] * 100
GRAVITY = np.array([0.0, 0.0, 9.81])


def imu(seconds: float = AT_REST) -> tuple[np.ndarray, np.ndarray]:
    """Gyro and accelerometer of a body at rest, shape (n, 3)."""
    noise = ImuNoise(1)
    samples = [noise.apply(np.zeros(3), GRAVITY) for _ in range(round(seconds * 200.0))]
    return np.array([one.gyro for one in samples]), np.array([one.accel for one in samples])


def test_the_bias_error_of_an_axis_is_within_3e_4_rad_per_s_in_99_of_100() -> None:
    errors, before = [], []
    for seed in range(120):
        gyro = ImuNoise(seed).gyro
        rates = np.array([gyro.apply(np.zeros(3)) for _ in range(round(AT_REST * 200.0))])
        bias = gyro.bias
        told = rest_of(rates, np.tile(GRAVITY, (len(rates), 1)), STILL, NO_TURN)
        errors.extend(np.abs(told.gyro - bias))
        before.extend(np.abs(bias))
    assert np.mean(np.array(errors) <= 3e-4) >= 0.99
    assert np.median(before) > 6e-4  # without a calibration


def test_the_means_come_with_their_spread_and_the_attitude_that_gravity_tells() -> None:
    roll, pitch = radians(2.0), radians(-3.0)
    gyro = np.tile([0.001, -0.002, 0.003], (400, 1)) + np.random.default_rng(1).normal(0.0, 0.002, (400, 3))
    down = 9.81 * np.array([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])
    told = rest_of(gyro, np.tile(down, (400, 1)), STILL, NO_TURN)
    assert told.samples == 400
    assert told.gyro == pytest.approx([0.001, -0.002, 0.003], abs=4e-4)
    assert told.gyro_sd == pytest.approx([0.002] * 3, rel=0.2)
    assert (told.roll, told.pitch) == pytest.approx((roll, pitch))


@pytest.mark.parametrize(
    ("gyro_sd", "speed", "turn", "reason"),
    [
        (0.03, 0.0, 0.0, r"the gyro shakes by 0\.0\d+ rad/s \(standard deviation\), more than 0\.02"),
        (0.002, 0.03, 0.0, r"moves at 0\.030 m/s, more than 0\.02"),
        (0.002, 0.0, 0.1, r"turns at 0\.100 rad/s, more than 0\.02"),
        (0.002, float("nan"), 0.0, "moves at nan m/s"),
    ],
)
def test_a_robot_that_is_not_at_rest_is_refused_with_the_figure(
    gyro_sd: float, speed: float, turn: float, reason: str
) -> None:
    gyro = np.random.default_rng(1).normal(0.0, gyro_sd, (400, 3))
    with pytest.raises(NotAtRest, match=reason):
        rest_of(gyro, np.tile(GRAVITY, (400, 1)), [speed] * 100, [turn] * 100)


def test_a_body_that_still_settles_is_refused() -> None:
    gyro, accel = imu()
    settling = accel + 9.81 * np.linspace(0.0, 4e-3, len(accel))[:, None] * [1.0, 0.0, 0.0]
    with pytest.raises(NotAtRest, match=r"tilts by 0\.00\d+ rad meanwhile"):
        rest_of(gyro, settling, STILL, NO_TURN)


def test_silent_sensors_are_no_rest() -> None:
    gyro, accel = imu(seconds=0.2)
    with pytest.raises(NotAtRest, match="IMU is silent: 40 samples"):
        rest_of(gyro, accel, STILL, NO_TURN)
    with pytest.raises(NotAtRest, match="there is no odometry"):
        rest_of(*imu(), [], [])
