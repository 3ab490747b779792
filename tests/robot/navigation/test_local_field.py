"""Distances around the robot against the exact ones of the shapes, and against a body made of many points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.estimation.movers import Mover
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.local_field import LocalField
from robot.planning.grid import Grid, signed_distance
from robot.scenes.scene import Box, Cylinder, Scene

SHAPES = (Cylinder(1.2, 0.4, 0.3), Box(-0.8, 1.0, 0.6, 0.3, yaw=0.5))
SCENE = Scene("two", (-4.0, -4.0, 4.0, 4.0), SHAPES, Pose2(0.0, 0.0), Pose2(0.0, 0.0))
CELL = 0.05
OFF = CELL / 2 + 3e-3
"""A point lies up to 18 mm from the middle of its half cell, and where two shapes are equally near the mean of two cells is lower, m."""
coordinates = st.floats(-2.5, 2.5)
headings = st.floats(-3.2, 3.2)


def field(*movers: Mover, footprint: Footprint | None = None) -> LocalField:
    made = LocalCostmap(Grid.from_scene(SCENE, CELL), footprint).local_field(Pose2(0.0, 0.0))
    return LocalField(made.grid, made.footprint, made.fine, made.top, made.left, made.changes, movers)


FIELD = field()


def exact(x: Floats, y: Floats) -> Floats:
    walls = 4.0 - np.maximum(np.abs(x), np.abs(y))
    return np.minimum.reduce([walls, *(signed_distance(shape, x, y) for shape in SHAPES)])


def body_points(footprint: Footprint, pose: Pose2) -> tuple[Floats, Floats]:
    """The body's rectangle as points every 2 cm, in the world."""
    across = np.linspace(-footprint.width / 2, footprint.width / 2, 26)
    along, across = np.meshgrid(np.linspace(-footprint.length / 2, footprint.length / 2, 56) + footprint.ahead, across)
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    return pose.x + c * along - s * across, pose.y + s * along + c * across


@given(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=20))
def test_the_clearance_of_a_point_is_its_distance_to_within_half_a_half_cell(points: list[tuple[float, float]]) -> None:
    x, y = np.array(points).T
    assert np.abs(FIELD.clearance(x, y) - exact(x, y)).max() <= OFF


@pytest.mark.parametrize("direction", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
def test_it_is_not_shifted_to_any_side(direction: float) -> None:
    """Rounding to half cells comes out even over a patch; an index that is off by one would show as 25 mm."""
    offsets = np.random.default_rng(1).uniform(-0.05, 0.05, (2, 400))
    x, y = 1.2 + 0.45 * np.cos(direction) + offsets[0], 0.4 + 0.45 * np.sin(direction) + offsets[1]
    assert (FIELD.clearance(x, y) - exact(x, y)).mean() == pytest.approx(0.0, abs=2e-3)


def test_a_point_outside_of_the_square_counts_as_its_rim() -> None:
    rim, beyond = np.array([2.98, -2.98, 1.0]), np.array([9.0, -50.0, 1.0])
    ordinate = np.array([0.0, 0.5, 2.98])
    assert FIELD.clearance(beyond, ordinate) == pytest.approx(FIELD.clearance(rim, ordinate), abs=OFF)


@settings(deadline=None)
@given(x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), yaw=headings)
def test_the_clearance_of_the_body_is_that_of_its_outline(x: float, y: float, yaw: float) -> None:
    """Where nothing reaches inside of it: then the nearest of its points lies on its edge."""
    pose = Pose2(x, y, yaw)
    truth = float(exact(*body_points(FIELD.footprint, pose)).min())
    if truth <= 0.0:
        return
    shown = FIELD.clearance_at(pose)
    assert shown >= truth - OFF - 0.01
    assert shown <= truth + 0.1 + OFF, "between two points of the outline a corner may be 10 cm nearer"


def test_poses_of_any_shape_are_answered_in_that_shape() -> None:
    x, y, yaw = np.zeros((3, 4)), np.ones((3, 4)), np.full((3, 4), 0.2)
    answer = FIELD.body_clearance(x, y, yaw)
    assert answer.shape == (3, 4)
    assert answer == pytest.approx(np.full((3, 4), FIELD.clearance_at(Pose2(0.0, 1.0, 0.2))))


@given(x=coordinates, y=coordinates, yaw=headings, vx=st.floats(-1, 1), vy=st.floats(-1, 1), after=st.floats(0.0, 2.5))
def test_what_moves_is_a_disc_carried_on_at_its_velocity(
    x: float, y: float, yaw: float, vx: float, vy: float, after: float
) -> None:
    body = Footprint(length=1.0, width=0.4, ahead=0.1)
    moving = field(Mover(0.5, -0.5, vx, vy, 0.2), Mover(5.0, 5.0, 0.0, 0.0, 0.4), footprint=body)
    shown = float(moving.mover_clearance(np.array([x]), np.array([y]), np.array([yaw]), np.array([after]))[0])
    px, py = body_points(body, Pose2(x, y, yaw))
    gaps = [
        np.hypot(px - 0.5 - vx * after, py + 0.5 - vy * after).min() - 0.2,
        np.hypot(px - 5.0, py - 5.0).min() - 0.4,
    ]
    assert shown == pytest.approx(min(gaps), abs=0.02)


def test_where_nothing_moves_there_is_all_the_room_in_the_world() -> None:
    clearance = FIELD.mover_clearance(np.zeros(3), np.zeros(3), np.zeros(3), np.array([[0.1], [0.2]]))
    assert clearance.shape == (2, 3)
    assert np.isinf(clearance).all()
