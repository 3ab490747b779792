"""The ideal LiDAR: exact against hand-worked distances and against a fine march along each beam."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.hardware.beams import beam_angles
from robot.planning.grid import signed_distance
from robot.scenes.scene import Box, Cylinder, Obstacle
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast
from tests.robot.stage import floor


def test_beams_start_behind_and_turn_left() -> None:
    angles = beam_angles(4)
    assert angles.tolist() == [-math.pi, -math.pi / 2, 0.0, math.pi / 2]
    ranges = cast(floor(Box(3.0, 0.0, 1.0, 1.0), Cylinder(0.0, 2.0, 0.5), Box(0.0, -4.0, 2.0, 2.0)), 0, 0, 0, beams=4)
    assert ranges == pytest.approx([10.0, 3.0, 2.5, 1.5])


def test_a_beam_that_is_parallel_to_a_face_but_for_the_last_digit_sees_what_a_parallel_one_sees() -> None:
    parallel = cast(floor(Box(3.0, 0.0, 1.0, 1.0)), 0.0, 0.0, 0.0)
    nearly = cast(floor(Box(3.0, 0.0, 1.0, 1.0, yaw=2.2e-311)), 0.0, 0.0, 0.0)
    assert nearly.tolist() == parallel.tolist()


def test_a_turned_sensor_sees_the_same_world_shifted() -> None:
    scene = get_world("warehouse")
    straight = cast(scene, 1.0, 0.5, 0.0)
    turned = cast(scene, 1.0, 0.5, math.pi / 2)
    assert np.roll(straight, -90) == pytest.approx(turned, abs=1e-9)


def test_no_return_is_the_maximum_range_and_inside_an_obstacle_is_zero() -> None:
    assert (cast(floor(), 0, 0, 0, max_range=7.0) == 7.0).all()
    assert (cast(floor(Box(0, 0, 2, 2)), 0.3, 0.2, 0.5) == 0.0).all()
    assert (cast(floor(Cylinder(0, 0, 1)), 0.3, 0.2, 0.5) == 0.0).all()
    assert (cast(floor(Box(12, 0, 1, 1)), 0, 0, 0) == 10.0).all()


def test_a_beam_over_a_low_obstacle_does_not_see_it() -> None:
    scene = floor(Box(2, 0, 1, 1, height=0.2), Cylinder(-2, 0, 0.5, height=1.0))
    ranges = cast(scene, 0, 0, 0, beams=4, height=0.5)
    assert ranges.tolist() == pytest.approx([1.5, 10.0, 10.0, 10.0])


def test_a_beam_in_the_plane_of_a_face_raises_no_warning() -> None:
    assert np.isfinite(cast(floor(Box(3.0, 0.5, 1.0, 1.0)), 0.0, 0.0, 0.0, beams=4)).all()


boxes = st.builds(
    Box,
    st.floats(-6, 6),
    st.floats(-6, 6),
    st.floats(0.2, 3),
    st.floats(0.2, 3),
    yaw=st.floats(-3.2, 3.2),
)
cylinders = st.builds(Cylinder, st.floats(-6, 6), st.floats(-6, 6), st.floats(0.1, 2))


@given(st.lists(boxes | cylinders, max_size=4), st.floats(-3.2, 3.2))
def test_every_range_ends_on_a_surface_and_nothing_stands_before_it(obstacles: list[Obstacle], yaw: float) -> None:
    scene = floor(*obstacles)
    ranges = cast(scene, 0.0, 0.0, yaw, beams=24)
    angles = beam_angles(24) + yaw

    def nearest(r: np.ndarray) -> np.ndarray:
        fields = [signed_distance(o, r * np.cos(angles), r * np.sin(angles)) for o in obstacles]
        return np.minimum.reduce(fields) if fields else np.full(24, np.inf)

    returned = (ranges > 0.0) & (ranges < 10.0)
    assert np.abs(nearest(ranges)[returned]).max(initial=0.0) < 1e-6
    for share in np.linspace(0.02, 0.98, 25):
        assert (nearest(ranges * share)[ranges > 0.0] > -1e-9).all()
