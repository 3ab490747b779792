"""What makes up for a load: zero without one, bounded with one, and in physics a robot that carries 14 kg level and high."""

from __future__ import annotations

from math import pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.trim import BEGIN, MOST, Trim
from robot.testing import Conditions, Record, Trial
from tests.robot.control.kit import DT

share = st.floats(-1.0, 1.0)


def learned(seconds: float, *errors: float) -> Trim:
    trim = Trim()
    for _ in range(round(seconds / DT)):
        trim.learn(DT, *errors)
    return trim


@given(shares=st.tuples(share, share, share), seconds=st.floats(0.0, 5.0))
def test_errors_that_noise_shows_add_up_to_exactly_nothing(shares: tuple[float, float, float], seconds: float) -> None:
    errors = [part * begin for part, begin in zip(shares, BEGIN, strict=True)]
    assert learned(seconds, *errors).value == (0.0, 0.0, 0.0)


def test_the_swing_of_a_stride_adds_up_to_nothing_though_it_goes_beyond_what_begins_it() -> None:
    trim = Trim()
    for step in range(2000):
        swing = sin(2.0 * pi * step * DT / 0.25)
        trim.learn(DT, *(2.0 * begin * swing for begin in BEGIN))
    assert trim.value == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_lasting_error_is_made_up_for_with_its_sign_up_to_a_bound_and_a_reset_forgets_it(sign: float) -> None:
    soon, late = learned(1.0, 0.076 * sign, 0.17 * sign, 0.0), learned(60.0, 0.076 * sign, 0.17 * sign, -0.17 * sign)
    assert 0.0 < sign * soon.value[0] < MOST[0]
    assert 0.0 < sign * soon.value[1] < MOST[1]
    assert soon.value[2] == 0.0
    assert late.value == (sign * MOST[0], sign * MOST[1], -sign * MOST[2])
    late.reset()
    late.learn(DT, 0.0, 0.0, 0.0)
    assert late.value == (0.0, 0.0, 0.0)


def test_once_begun_it_goes_on_until_nothing_is_left_of_the_error() -> None:
    """A body whose height follows the lift by a spring, with a load of 4 m/s2."""
    trim, low = Trim(), 4.0 / 60.0
    for _ in range(round(8.0 / DT)):
        trim.learn(DT, low, 0.0, 0.0)
        low = (4.0 - trim.value[0]) / 60.0
    assert low == pytest.approx(0.0, abs=1e-4)
    assert trim.value == (pytest.approx(4.0, rel=1e-2), 0.0, 0.0)


def test_when_the_load_is_taken_off_it_comes_back_to_zero_and_stays_there() -> None:
    trim = learned(1.0, 0.05, 0.0, 0.0)
    for _ in range(round(8.0 / DT)):
        trim.learn(DT, -trim.value[0] / 60.0 - 0.005, 0.0, 0.0)
    assert trim.value == (0.0, 0.0, 0.0)


def test_fourteen_kilograms_sink_and_tilt_the_body_by_millimetres_and_a_degree_at_most() -> None:
    def walked(conditions: Conditions) -> Record:
        trial = Trial(3, conditions=conditions)
        trial.stand_up()
        trial.run(4.0, (0.5, 0.0, 0.0))
        record = trial.run(2.0)
        assert not trial.fallen
        return record

    height = walked(Conditions()).height.mean()
    for place in ((0.0, 0.0), (0.25, 0.1)):
        loaded = walked(Conditions(payload=14.0, payload_at=place))
        assert loaded.height.mean() == pytest.approx(height, abs=0.008), place
        assert np.abs(np.degrees(loaded.lean.mean(axis=0))).max() < 1.0, place


def test_a_robot_without_a_load_walks_without_an_integral() -> None:
    """Also while it stands up, speeds up and lowers itself."""
    trial, seen = Trial(5), set[tuple[float, ...]]()
    trial.stand_up()
    for speed in (1.6, 0.0):
        trial.run(0.1, (speed, 0.0, 0.3))
        for _ in range(500):
            trial.step()
            seen.add(trial.gait.trim)
    assert seen == {(0.0, 0.0, 0.0)}
