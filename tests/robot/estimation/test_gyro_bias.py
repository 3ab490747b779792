"""The gyro's bias against Gaussian conditioning on all samples at once, and the line between two feet against a fitted line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.gyro_bias import FIRST, GRAVITY_GAIN, STILL_RATE, WALK, WHITE, FootLine, GyroBias
from robot.geometry.vectors import Floats

APART = (0.6, 0.3, 0.05)
"""From one foot to the other, m."""
NO_ROLL = (0.0, 0.0, 0.0)


@pytest.mark.parametrize("hz", [100, 200, 500])
def test_at_rest_it_is_what_a_gaussian_process_tells_of_a_walking_bias_under_white_noise(hz: int) -> None:
    dt, random, bias = 1.0 / hz, np.random.default_rng(hz), GyroBias()
    shown = random.normal((1e-3, -5e-4, 2e-3), WHITE * hz**0.5, (40, 3))
    for sample in shown:
        bias.wander(dt)
        bias.rest(dt, tuple(sample))
    count = np.arange(1, len(shown) + 1)
    prior = FIRST**2 + WALK**2 * dt * np.minimum.outer(count, count)
    cross = prior[-1]
    gain = np.linalg.solve(prior + WHITE**2 / dt * np.eye(len(shown)), cross)
    assert bias.value == pytest.approx(tuple(gain @ shown), rel=1e-9)
    assert bias.deviation == pytest.approx((float(np.sqrt(cross[-1] - gain @ cross)),) * 3, rel=1e-9)


def test_while_nothing_is_measured_its_variance_grows_with_time_and_not_with_samples() -> None:
    often, once = GyroBias(), GyroBias()
    for _ in range(500):
        often.wander(0.2)
    once.wander(100.0)
    assert often.deviation == pytest.approx(once.deviation)
    assert once.deviation[0] == pytest.approx((FIRST**2 + 100.0 * WALK**2) ** 0.5)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_robot_that_shows_more_than_five_sigma_on_one_axis_is_not_at_rest(axis: int) -> None:
    bias, shown = GyroBias(), [1e-3, 1e-3, 1e-3]
    shown[axis] = -STILL_RATE * 1.01
    bias.rest(0.005, tuple(shown))
    assert bias.value == (0.0, 0.0, 0.0)
    assert bias.deviation == pytest.approx((FIRST,) * 3)
    shown[axis] = -STILL_RATE * 0.99
    bias.rest(0.005, tuple(shown))
    assert bias.value[axis] < 0.0 < bias.value[axis - 1]


def test_rest_is_judged_by_what_is_left_of_the_rate_without_the_bias() -> None:
    bias = GyroBias()
    for _ in range(5000):
        bias.wander(0.005)
        bias.rest(0.005, (0.01, 0.0, 0.0))
    known = bias.value[0]
    assert known == pytest.approx(0.01, rel=0.01)
    bias.rest(0.005, (known - 1.01 * STILL_RATE, 0.0, 0.0))
    assert bias.value[0] == known
    bias.rest(0.005, (known - 0.99 * STILL_RATE, 0.0, 0.0))
    assert bias.value[0] < known


def test_gravity_integrates_the_horizons_error_over_time_with_opposite_sign() -> None:
    bias = GyroBias()
    for _ in range(200):
        bias.lean(0.005, 0.02, -0.01)
    assert bias.value == pytest.approx((-GRAVITY_GAIN * 0.02, GRAVITY_GAIN * 0.01, 0.0))
    assert bias.deviation == pytest.approx((FIRST,) * 3)


@given(rate=st.floats(-0.02, 0.02), sigma=st.floats(1e-4, 1e-2))
def test_what_seems_to_turn_moves_the_bias_of_the_vertical_by_its_share_of_information(
    rate: float, sigma: float
) -> None:
    bias = GyroBias()
    bias.turning(rate, sigma**2)
    information = np.array((FIRST**-2, sigma**-2))
    assert bias.value == pytest.approx((0.0, 0.0, rate * information[1] / information.sum()), abs=1e-15)
    assert bias.deviation == pytest.approx((FIRST, FIRST, information.sum() ** -0.5))


def told(
    angles: Floats, dt: float, roll: tuple[float, float, float] = NO_ROLL, length: float = 1.0
) -> tuple[float, float] | None:
    """What the line tells of a stance in which it had these angles, once the stance has ended."""
    line = FootLine()
    for angle in angles:
        arm = (length * float(np.cos(angle)), length * float(np.sin(angle)), 0.1)
        assert line.update(dt, (0, 3), arm, roll) is None
    return line.update(dt, (1, 2), APART, NO_ROLL)


@pytest.mark.parametrize("hz", [100, 200, 500])
@given(
    seed=st.integers(0, 1000),
    rate=st.floats(-0.01, 0.01),
    begin=st.sampled_from((-3.0, 0.4, float(np.pi), -float(np.pi))),
)
def test_the_lines_rate_is_the_slope_of_a_line_fitted_through_its_angles(
    hz: int, seed: int, rate: float, begin: float
) -> None:
    time = np.arange(round(0.3 * hz)) / hz
    angles = begin + rate * time + np.random.default_rng(seed).normal(0.0, 3e-4, len(time))
    found = told(angles, 1.0 / hz)
    assert found is not None
    assert found[0] == pytest.approx(float(np.polyfit(time, angles, 1)[0]), abs=1e-9)
    scatter = FootLine.ANGLE_NOISE**2 / float(((time - time.mean()) ** 2).sum())
    assert found[1] == pytest.approx(scatter + FootLine.CREEP**2, rel=1e-9)


def test_what_the_feets_rolling_turns_it_is_taken_off() -> None:
    """The line turns at 0.05 rad/s because one foot rolls across it: that says nothing about the gyro."""
    time, length = np.arange(40) * 0.005, 0.7
    line = FootLine()
    for angle in 0.4 + 0.05 * time:
        c, s = float(np.cos(angle)), float(np.sin(angle))
        line.update(0.005, (0, 3), (length * c, length * s, 0.0), (-0.05 * length * s, 0.05 * length * c, 0.3))
    found = line.update(0.005, (-1, -1), NO_ROLL, NO_ROLL)
    assert found is not None
    assert found[0] == pytest.approx(0.0, abs=1e-5)


def test_a_short_stance_and_a_slip_tell_nothing() -> None:
    assert told(np.zeros(20), 0.005) is None, "95 ms"
    assert told(np.zeros(22), 0.005) is not None, "105 ms"
    assert told(FootLine.FASTEST * 1.01 * np.arange(60) * 0.005, 0.005) is None
    assert told(-FootLine.FASTEST * 0.99 * np.arange(60) * 0.005, 0.005) is not None


def test_each_stance_begins_anew_and_without_a_pair_there_is_none() -> None:
    line = FootLine()
    for pair, rate in (((0, 3), 0.01), ((-1, -1), 0.0), ((1, 2), -0.005)):
        for step in range(40):
            angle = rate * step * 0.005
            found = line.update(0.005, pair, (float(np.cos(angle)), float(np.sin(angle)), 0.0), NO_ROLL)
            if step:
                assert found is None
            elif pair == (-1, -1):
                assert found is not None
                assert found[0] == pytest.approx(0.01)
    last = line.update(0.005, (0, 3), APART, NO_ROLL)
    assert last is not None
    assert last[0] == pytest.approx(-0.005)
