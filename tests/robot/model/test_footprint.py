"""The body's rectangle against a body made of many points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import distance
from scipy.spatial.transform import Rotation

from robot.model.actuators import ActuatorDesign
from robot.model.battery import PackDesign
from robot.model.bodies import B2, GO2
from robot.model.footprint import Footprint
from robot.model.power import typical_motor_power
from robot.model.robot import SPOT

bodies = st.builds(Footprint, st.floats(0.3, 2.0), st.floats(0.2, 1.0), st.floats(-0.3, 0.3))
coordinate = st.floats(-3.0, 3.0)


def corners(body: Footprint) -> np.ndarray:
    return np.array([(sx * body.length / 2 + body.ahead, sy * body.width / 2) for sx in (-1, 1) for sy in (-1, 1)])


@given(bodies)
def test_its_circles_are_those_of_its_sides_and_its_farthest_corner(body: Footprint) -> None:
    assert body.inscribed == body.width / 2
    assert body.circumscribed == pytest.approx(float(np.linalg.norm(corners(body), axis=1).max()))


@given(bodies)
def test_the_outline_runs_along_the_four_sides_in_steps_of_10_cm_at_most(body: Footprint) -> None:
    relative = np.abs(body.outline - (body.ahead, 0.0)) / (body.length / 2, body.width / 2)
    assert relative.max(axis=1) == pytest.approx(np.ones(len(relative))), "every point lies on an edge"
    assert distance.cdist(corners(body), body.outline).min(axis=1) == pytest.approx(np.zeros(4), abs=1e-9)
    for axis, side in ((0, 1), (1, 0)):
        for edge in (-1.0, 1.0):
            middle = (body.ahead, 0.0)[side] + edge * (body.length, body.width)[side] / 2
            on_edge = np.sort(body.outline[np.abs(body.outline[:, side] - middle) < 1e-9, axis])
            assert np.diff(on_edge).max() <= 0.1 + 1e-9
    assert len(np.unique(body.outline.round(9), axis=0)) == len(body.outline), "no point twice"


@given(bodies, st.floats(0.0, 1.0), st.integers(0, 3))
def test_a_post_of_15_cm_that_touches_the_outline_is_less_than_2_cm_from_one_of_its_points(
    body: Footprint, share: float, side: int
) -> None:
    along, sign = side % 2, 1.0 if side < 2 else -1.0
    half = np.array((body.length, body.width)) / 2
    post = np.array((body.ahead, 0.0))
    post[along] += (2.0 * share - 1.0) * half[along]
    post[1 - along] += sign * (half[1 - along] + 0.075)
    assert np.hypot(*(body.outline - post).T).min() - 0.075 < 0.02


@given(bodies, coordinate, coordinate, st.floats(-4.0, 4.0))
def test_placed_it_is_turned_and_then_moved(body: Footprint, x: float, y: float, yaw: float) -> None:
    px, py = body.placed(np.array([x, 0.0]), np.array([y, 0.0]), np.array([yaw, 0.0]))
    assert px.shape == (2, len(body.outline))
    solid = np.column_stack((body.outline, np.zeros(len(body.outline))))
    truth = Rotation.from_euler("z", yaw).apply(solid) + np.array((x, y, 0.0))
    assert np.column_stack((px[0], py[0])) == pytest.approx(truth[:, :2])
    assert np.column_stack((px[1], py[1])) == pytest.approx(body.outline)


@given(bodies, coordinate, coordinate)
def test_distances_are_those_to_the_nearest_of_its_points(body: Footprint, x: float, y: float) -> None:
    along = np.linspace(-body.length / 2, body.length / 2, 81) + body.ahead
    across = np.linspace(-body.width / 2, body.width / 2, 41)
    points = np.stack(np.meshgrid(along, across), axis=-1).reshape(-1, 2)
    nearest = distance.cdist([(x, y)], points).min()
    assert body.distances(np.array([x]), np.array([y]))[0] == pytest.approx(nearest, abs=0.02)


def test_points_inside_and_on_the_edge_have_no_distance() -> None:
    body = Footprint(length=1.0, width=0.4, ahead=0.1)
    x, y = np.array([0.1, 0.6, -0.4, 0.7, 0.6, 0.9]), np.array([0.0, 0.2, -0.2, 0.0, 0.3, 0.6])
    assert body.distances(x, y) == pytest.approx([0.0, 0.0, 0.0, 0.1, 0.1, 0.5])


def test_the_body_of_the_data_sheet_turns_on_a_circle_of_121_cm() -> None:
    assert 2 * Footprint().circumscribed == pytest.approx(math.hypot(1.1, 0.5))


def test_the_outline_covers_the_rectangle() -> None:
    footprint = Footprint()
    assert footprint.circumscribed == pytest.approx(0.604, abs=1e-3)
    assert np.abs(footprint.outline).max(axis=0).tolist() == [0.55, 0.25]
    inside = footprint.distances(np.array([0.5, 0.0, 0.85]), np.array([0.2, 0.55, 0.65]))
    assert inside.tolist() == pytest.approx([0.0, 0.3, 0.5])


def test_a_footprint_that_reaches_farther_back_is_a_rectangle_about_another_middle() -> None:
    footprint = Footprint(length=1.1, width=0.46, ahead=-0.08)
    x, y = footprint.outline.T
    assert (x.min(), x.max()) == pytest.approx((-0.63, 0.47))
    assert (y.min(), y.max()) == pytest.approx((-0.23, 0.23))
    assert footprint.circumscribed == pytest.approx(math.hypot(0.63, 0.23))
    near = footprint.distances(np.array([0.5, -0.7, 0.0]), np.array([0.0, 0.0, 0.33]))
    assert near == pytest.approx([0.03, 0.07, 0.10])


def test_a_robots_rectangle_is_that_of_the_reference_body_for_its_size() -> None:
    assert Footprint.of(SPOT) == Footprint()
    small = Footprint.of(GO2)
    assert (small.length, small.width) == pytest.approx((0.713, 0.393), abs=1e-3)
    assert Footprint.of(B2).width > Footprint().width


def test_batteries_and_drives_are_as_strong_for_a_robots_mass_as_the_reference_bodys() -> None:
    assert (PackDesign.of(SPOT), ActuatorDesign.of(SPOT)) == (PackDesign(), ActuatorDesign())
    pack, drives = PackDesign.of(GO2), ActuatorDesign.of(GO2)
    assert pack.energy_wh / GO2.mass == pytest.approx(PackDesign().energy_wh / SPOT.mass)
    assert pack.charger_current / PackDesign().charger_current == pytest.approx(GO2.mass / SPOT.mass)
    alike = typical_motor_power(SPOT.froude(0.3), 0.0, 0.0, walking=True) / (SPOT.mass * SPOT.froude(0.3))
    assert typical_motor_power(GO2.froude(0.3), 0.0, 0.0, walking=True, model=GO2) / (
        GO2.mass * GO2.froude(0.3)
    ) == pytest.approx(alike)
    assert drives.no_load > ActuatorDesign().no_load
    assert drives.bus_current < ActuatorDesign().bus_current
