"""The charging station by its face: exact where the scan is exact, and silent where it is no station."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.estimation.dock_finder import find_dock
from robot.geometry.planar import Pose2, compose
from robot.geometry.vectors import Floats
from robot.scenes.dock import FACE_AHEAD, FACE_WIDTH, station
from robot.scenes.scene import Box, Obstacle, Scene
from robot.sim.lidar_rays import cast

DOCK = Pose2(-1.0, 2.0, 2.2)
AT_DOCK = Pose2(0.0, 0.0)
BEFORE = st.builds(Pose2, st.floats(-0.8, 0.0), st.floats(-0.15, 0.15), st.floats(-0.3, 0.3))
"""Where an approach passes and only the face is in sight, in the dock's frame."""


def scene(*obstacles: Obstacle) -> Scene:
    return Scene("dock", (-20.0, -20.0, 20.0, 20.0), obstacles, AT_DOCK, AT_DOCK)


def seen(robot: Pose2, *obstacles: Obstacle, dock: Pose2 = DOCK) -> Floats:
    """A scan from `robot`, given in the dock's frame, of the station or of what stands in its place."""
    here = compose(dock, robot)
    return cast(scene(*(obstacles or (station(dock),))), here.x, here.y, here.yaw)


def assert_near(found: Pose2 | None, truth: Pose2, metres: float, radians: float) -> None:
    assert found is not None
    assert (found.x, found.y) == pytest.approx((truth.x, truth.y), abs=metres)
    assert found.yaw == pytest.approx(truth.yaw, abs=radians)


@settings(deadline=None, max_examples=40)
@given(robot=BEFORE, dx=st.floats(-0.06, 0.06), dy=st.floats(-0.1, 0.1), turn=st.floats(-0.15, 0.15))
def test_a_belief_that_is_wrong_is_put_right_in_distance_and_heading(
    robot: Pose2, dx: float, dy: float, turn: float
) -> None:
    """Along the face the ends are known to the nearest beam only: 1 degree at 1.6 m is 3 cm."""
    believed = Pose2(robot.x + dx / 2, robot.y + dy, robot.yaw + turn)
    found = find_dock(seen(robot), compose(DOCK, believed), DOCK)
    assert found is not None
    assert found.x == pytest.approx(robot.x, abs=5e-3)
    assert found.y == pytest.approx(robot.y, abs=0.03)
    assert found.yaw == pytest.approx(robot.yaw, abs=2e-3)


@settings(deadline=None, max_examples=40)
@given(robot=BEFORE, x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), yaw=st.floats(-3.1, 3.1))
def test_where_the_dock_stands_makes_no_difference(robot: Pose2, x: float, y: float, yaw: float) -> None:
    moved = Pose2(x, y, yaw)
    one = find_dock(seen(robot), compose(DOCK, robot), DOCK)
    other = find_dock(seen(robot, dock=moved), compose(moved, robot), moved)
    assert one is not None
    assert_near(other, one, 0.02, 2e-3)


def test_the_answer_is_the_mean_over_noise_and_one_scan_is_worse() -> None:
    random, robot = np.random.default_rng(2), Pose2(-0.3, 0.05, 0.1)
    exact = seen(robot)
    found = [
        find_dock(np.minimum(exact + random.normal(0, 0.015, 360), 10.0), compose(DOCK, robot), DOCK) for _ in range(80)
    ]
    poses = np.array([(p.x, p.y, p.yaw) for p in found if p is not None])
    assert len(poses) >= 75
    assert np.abs(np.median(np.abs(poses - (robot.x, robot.y, robot.yaw)), axis=0) < (0.03, 0.03, 0.035)).all()
    assert poses.mean(axis=0) == pytest.approx((robot.x, robot.y, robot.yaw), abs=0.012)
    assert poses[:, 0].std() > 0.002


def turned_face(angle: float) -> Box:
    """A station that stands turned about the middle of its face."""
    depth = 0.15
    out = Rotation.from_euler("z", DOCK.yaw + angle).apply((depth / 2, 0.0, 0.0))
    face = compose(DOCK, Pose2(FACE_AHEAD, 0.0))
    return Box(face.x + float(out[0]), face.y + float(out[1]), depth, FACE_WIDTH, yaw=DOCK.yaw + angle)


@pytest.mark.parametrize("angle", [-0.2, 0.2])
def test_a_station_that_stands_askew_is_the_frame_that_counts(angle: float) -> None:
    robot = Pose2(-0.2, 0.0, 0.0)
    found = find_dock(seen(robot, turned_face(angle)), compose(DOCK, robot), DOCK)
    assert found is not None
    about = Rotation.from_euler("z", -angle).apply((robot.x - FACE_AHEAD, robot.y, 0.0))
    assert_near(found, Pose2(FACE_AHEAD + float(about[0]), float(about[1]), -angle), 0.05, 0.03)


def wide(width: float) -> Box:
    return dataclasses.replace(station(DOCK), width=width)


@pytest.mark.parametrize(
    ("why", "shape"),
    [
        ("a wall is no face", wide(3.0)),
        ("half hidden", wide(0.2)),
        ("too far askew", turned_face(0.6)),
        ("elsewhere", Box(8.0, 8.0, 0.15, 0.4)),
    ],
)
def test_what_is_no_face_of_a_station_is_not_taken_for_one(why: str, shape: Box) -> None:
    robot = Pose2(-0.2, 0.0, 0.0)
    assert find_dock(seen(robot, shape), compose(DOCK, robot), DOCK) is None, why


def test_a_post_that_stands_before_the_face_is_left_out_of_the_line() -> None:
    robot = Pose2(-0.3, 0.0, 0.0)
    exact = seen(robot)
    face = np.flatnonzero(exact < 2.0)
    disturbed = exact.copy()
    disturbed[face[len(face) // 2 - 1 : len(face) // 2 + 1]] -= 0.09
    found = find_dock(disturbed, compose(DOCK, robot), DOCK)
    assert_near(found, robot, 0.03, 5e-3)


def test_seven_returns_say_too_little_and_no_returns_nothing() -> None:
    robot, ranges = Pose2(-0.3, 0.0, 0.0), np.full(360, 10.0)
    assert find_dock(ranges, compose(DOCK, robot), DOCK) is None
    exact = seen(robot)
    face = np.flatnonzero(exact < 2.0)
    spread = face[np.linspace(0, len(face) - 1, 8).astype(int)]
    ranges[spread] = exact[spread]
    assert find_dock(ranges, compose(DOCK, robot), DOCK) is not None
    ranges[spread[3]] = np.nan
    assert find_dock(ranges, compose(DOCK, robot), DOCK) is None
