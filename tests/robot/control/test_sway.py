"""The sway of the crawl: the motion of a linear inverted pendulum over a balance point that goes to and fro."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from robot.control.sway import sway
from robot.geometry.vectors import Floats
from robot.model.parameters import GRAVITY

phases = st.floats(0.0, 1.0)
periods = st.floats(0.5, 2.0)
reaches = st.floats(0.01, 0.1)
heights = st.floats(0.3, 0.6)


def balance_point(phase: float, reach: float, change: float) -> float:
    """The three harmonics of the trapezoid that are used."""
    return sum(4.0 * reach / (math.pi * k) * np.sinc(k * change) * math.sin(math.tau * k * phase) for k in (1, 3, 5))


@given(phase=phases, period=periods, reach=reaches, height=heights)
def test_it_is_the_motion_of_a_linear_inverted_pendulum(
    phase: float, period: float, reach: float, height: float
) -> None:
    place, _, push = sway(phase, period, reach, 0.1, height)
    assert push == pytest.approx(GRAVITY / height * (place - balance_point(phase, reach, 0.1)), abs=1e-9)


def test_a_solver_of_differential_equations_goes_the_same_way() -> None:
    """Backwards and forwards the pendulum is unstable, so it is followed for a third of a period only."""
    period, reach, height = 1.0, 0.06, 0.5

    def pendulum(t: float, y: Floats) -> Floats:
        return np.array((y[1], GRAVITY / height * (y[0] - balance_point(t / period, reach, 0.1))))

    found = solve_ivp(pendulum, (0.0, 0.33), sway(0.0, period, reach, 0.1, height)[:2], rtol=1e-9, atol=1e-12)
    assert found.y[:, -1] == pytest.approx(sway(0.33, period, reach, 0.1, height)[:2], abs=1e-6)


@given(phase=phases, period=periods, reach=reaches, height=heights)
def test_velocity_and_acceleration_are_the_derivatives(
    phase: float, period: float, reach: float, height: float
) -> None:
    step = 1e-4
    before, now, after = (sway(phase + shift, period, reach, 0.1, height) for shift in (-step, 0.0, step))
    dt = step * period
    assert (after[0] - before[0]) / (2 * dt) == pytest.approx(now[1], abs=1e-4)
    assert (after[1] - before[1]) / (2 * dt) == pytest.approx(now[2], abs=1e-2)


@given(period=periods, reach=reaches, height=heights)
def test_the_balance_point_lies_on_the_side_that_carries(period: float, reach: float, height: float) -> None:
    for phase in np.linspace(0.0, 1.0, 41).tolist():
        place, _, push = sway(phase, period, reach, 0.1, height)
        balance = place - height / GRAVITY * push
        assert abs(balance) < 1.25 * reach
        if 0.1 < phase < 0.4:
            assert balance > 0.8 * reach
        if 0.6 < phase < 0.9:
            assert balance < -0.8 * reach


@given(phase=phases, period=periods, reach=reaches, height=heights)
def test_half_a_period_later_it_is_on_the_other_side_and_a_whole_one_later_the_same(
    phase: float, period: float, reach: float, height: float
) -> None:
    now, half, whole = (np.array(sway(phase + later, period, reach, 0.1, height)) for later in (0.0, 0.5, 1.0))
    assert half == pytest.approx(-now, abs=1e-9)
    assert whole == pytest.approx(now, abs=1e-9)


def test_a_quick_sway_is_small_and_a_slow_one_as_wide_as_the_balance_points() -> None:
    widths = [sway(0.25, period, 0.06, 0.1, 0.5)[0] for period in (0.25, 0.5, 1.0, 2.0, 200.0)]
    assert widths == sorted(widths)
    assert widths[0] < 0.1 * widths[-1]
    assert widths[-1] == pytest.approx(balance_point(0.25, 0.06, 0.1), rel=1e-3)


@given(phase=phases, period=periods, reach=reaches, height=heights)
def test_twice_the_reach_is_twice_the_sway(phase: float, period: float, reach: float, height: float) -> None:
    once, twice = (np.array(sway(phase, period, times * reach, 0.1, height)) for times in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * once, abs=1e-12)
