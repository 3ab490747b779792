"""The way of a foot through the air: boundary values, derivative, symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline

from robot.control.swing import smooth, swing_path
from robot.geometry.vectors import Triple
from tests.robot.control.kit import turned_about_z

START, END = (0.0, 0.1, 0.0), (0.3, 0.1, 0.05)

place = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.1, 0.1))
part = st.floats(0.0, 1.0)
inner = st.floats(0.01, 0.99)


def test_a_swing_starts_and_ends_at_rest_and_clears_the_ground_between() -> None:
    for progress, at in ((0.0, START), (1.0, END)):
        position, velocity = swing_path(START, END, progress, 0.25, 0.08)
        assert position == pytest.approx(at, abs=1e-12)
        assert velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    middle, _ = swing_path(START, END, 0.5, 0.25, 0.08)
    assert middle == pytest.approx((0.15, 0.1, 0.025 + 0.08))


@given(progress=part)
def test_the_share_is_the_cubic_with_flat_ends(progress: float) -> None:
    assert smooth(progress) == pytest.approx(float(CubicHermiteSpline([0, 1], [0, 1], [0, 0])(progress)), abs=1e-12)
    assert smooth(progress) + smooth(1.0 - progress) == pytest.approx(1.0)


@given(a=part, b=part)
def test_the_share_never_falls(a: float, b: float) -> None:
    assert smooth(min(a, b)) <= smooth(max(a, b))


@given(start=place, end=place, progress=inner, duration=st.floats(0.1, 0.5))
def test_the_velocity_is_the_derivative_of_the_position(
    start: Triple, end: Triple, progress: float, duration: float
) -> None:
    step = 1e-6
    before, _ = swing_path(start, end, progress - step, duration, 0.06)
    after, _ = swing_path(start, end, progress + step, duration, 0.06)
    _, velocity = swing_path(start, end, progress, duration, 0.06)
    difference = [(b - a) / (2 * step * duration) for a, b in zip(before, after, strict=True)]
    assert velocity == pytest.approx(difference, abs=1e-5)


@pytest.mark.parametrize("axis", range(3))
def test_the_velocity_adds_up_to_the_way(axis: int) -> None:
    way, _ = quad(lambda t: swing_path(START, END, t / 0.25, 0.25, 0.08)[1][axis], 0.0, 0.25)
    assert way == pytest.approx(END[axis] - START[axis], abs=1e-9)


def test_over_the_ground_it_is_never_faster_than_one_and_a_half_times_its_mean() -> None:
    speeds = [swing_path(START, END, progress, 0.25, 0.0)[1][0] for progress in np.linspace(0.0, 1.0, 101)]
    assert max(speeds) == pytest.approx(1.5 * 0.3 / 0.25)
    assert speeds[50] == max(speeds)


@given(start=place, end=place, progress=part)
def test_the_way_back_is_the_way_there_in_reverse(start: Triple, end: Triple, progress: float) -> None:
    there, speed = swing_path(start, end, progress, 0.3, 0.06)
    back, reversed_speed = swing_path(end, start, 1.0 - progress, 0.3, 0.06)
    assert back == pytest.approx(there, abs=1e-12)
    assert reversed_speed == pytest.approx([-part for part in speed], abs=1e-9)


@given(start=place, end=place, progress=part, yaw=st.floats(-3.0, 3.0))
def test_a_turned_world_turns_the_way(start: Triple, end: Triple, progress: float, yaw: float) -> None:
    plain = swing_path(start, end, progress, 0.3, 0.06)
    a, b = (tuple(turned_about_z(point, yaw).tolist()) for point in (start, end))
    turned = swing_path(a, b, progress, 0.3, 0.06)  # type: ignore[arg-type]
    for before, after in zip(plain, turned, strict=True):
        assert after == pytest.approx(turned_about_z(before, yaw), abs=1e-9)


@given(progress=part, clearance=st.floats(0.01, 0.2))
def test_the_foot_is_never_below_the_line_nor_higher_above_it_than_the_clearance(
    progress: float, clearance: float
) -> None:
    (_, _, z), _ = swing_path(START, END, progress, 0.25, clearance)
    above = z - 0.05 * smooth(progress)
    assert -1e-12 <= above <= clearance + 1e-12
