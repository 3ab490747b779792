"""The plane under the feet against numpy's least squares, and its low-pass against the exponential."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robot.estimation.terrain import IN_LINE, SETTLE, STEEPEST, TerrainPlane, plane
from robot.geometry.vectors import Floats, Triple
from robot.model.stance import NOMINAL

slopes = st.floats(-0.5, 0.5)
places = st.lists(st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3))), min_size=4, max_size=4)


def on_plane(slope_x: float, slope_y: float, height: float = 0.0) -> list[Triple]:
    return [(x, y, height + slope_x * x + slope_y * y) for x, y in NOMINAL]


def moments(feet: list[Triple]) -> Floats:
    floor = np.array(feet)[:, :2]
    return (floor - floor.mean(axis=0)).T @ (floor - floor.mean(axis=0))


@given(feet=places)
def test_it_is_the_least_squares_fit(feet: list[Triple]) -> None:
    (xx, xy), (_, yy) = moments(feet)
    assume(xx * yy - xy * xy > 10 * IN_LINE)
    middle, slope = plane(feet)
    points = np.array(feet)
    fitted = np.linalg.lstsq(np.column_stack((points[:, :2], np.ones(4))), points[:, 2], rcond=None)[0]
    assert slope == pytest.approx(tuple(fitted[:2]), abs=1e-9)
    assert middle == pytest.approx(tuple(points.mean(axis=0)))


@given(direction=st.floats(0.0, 3.2), off=st.floats(-1e-3, 1e-3))
def test_of_feet_in_a_line_there_is_a_middle_and_no_slope(direction: float, off: float) -> None:
    c, s = float(np.cos(direction)), float(np.sin(direction))
    feet = [
        (a * c - off * s * (-1) ** n, a * s + off * c * (-1) ** n, 0.1 * a) for n, a in enumerate((-0.3, 0.0, 0.2, 0.5))
    ]
    middle, slope = plane(feet)
    assert slope is None
    assert middle == pytest.approx(tuple(np.mean(feet, axis=0)))


@given(feet=places, shift=st.tuples(*(st.floats(-50.0, 50.0) for _ in range(3))))
def test_where_the_robot_is_makes_no_difference_to_the_slope(feet: list[Triple], shift: Triple) -> None:
    with np.errstate(divide="ignore"):  # NumPy warns of a determinant of zero if a number is very small
        assume(np.linalg.det(moments(feet)) > 1e-2)
    moved = [(x + shift[0], y + shift[1], z + shift[2]) for x, y, z in feet]
    here, there = plane(feet)[1], plane(moved)[1]
    assert here is not None
    assert there == pytest.approx(here, abs=1e-9)


@pytest.mark.parametrize("hz", [100, 200, 500])
@given(slope_x=slopes, slope_y=slopes)
def test_a_slope_is_taken_over_with_a_time_constant_of_a_quarter_second(
    hz: int, slope_x: float, slope_y: float
) -> None:
    terrain = TerrainPlane()
    for _ in range(round(SETTLE * hz)):
        terrain.update(1.0 / hz, on_plane(slope_x, slope_y))
    share = 1.0 - np.exp(-1.0)
    assert (terrain.slope_x, terrain.slope_y) == pytest.approx((share * slope_x, share * slope_y), abs=1e-9)


def test_what_is_too_steep_to_climb_counts_as_the_steepest() -> None:
    terrain = TerrainPlane()
    for _ in range(400):
        terrain.update(0.01, on_plane(0.9, -2.0))
    assert (terrain.slope_x, terrain.slope_y) == pytest.approx((STEEPEST, -STEEPEST), abs=1e-6)


@given(slope_x=slopes, slope_y=slopes, height=st.floats(-1.0, 1.0), x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0))
def test_the_height_of_any_place_is_that_of_the_plane_once_it_has_settled(
    slope_x: float, slope_y: float, height: float, x: float, y: float
) -> None:
    terrain = TerrainPlane()
    for _ in range(50):
        terrain.update(0.2, on_plane(slope_x, slope_y, height))
    assert terrain.height(x, y) == pytest.approx(height + slope_x * x + slope_y * y, abs=1e-6)


def test_feet_in_a_line_keep_the_slope_and_move_the_height() -> None:
    terrain = TerrainPlane()
    for _ in range(100):
        terrain.update(0.1, on_plane(0.2, 0.1))
    before = terrain.slope_x, terrain.slope_y
    terrain.update(0.1, [(x, 0.0, 1.0) for x in (-0.3, -0.1, 0.1, 0.3)])
    assert (terrain.slope_x, terrain.slope_y) == before
    assert terrain.height(0.0, 0.0) == pytest.approx(1.0)
