"""Going somewhere without a map: the empty grid, and what its navigator counts as there."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.navigation.motion import State
from robot.planning.planner import Margins
from tests.figures.unmapped import SHEET, WALKING, Tuning, unmapped_grid, unmapped_navigator

poses = st.builds(Pose2, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.0, 3.0))


@given(start=poses, goal=poses)
@settings(max_examples=20)
def test_the_grid_is_free_and_reaches_five_metres_beyond_both(start: Pose2, goal: Pose2) -> None:
    grid = unmapped_grid(start, goal)
    assert not grid.occupied.any()
    for pose in (start, goal):
        for dx, dy in ((4.9, 0.0), (-4.9, 0.0), (0.0, 4.9), (0.0, -4.9), (4.9, 4.9), (-4.9, -4.9)):
            assert grid.cell(pose.x + dx, pose.y + dy) is not None
    wide, high = abs(start.x - goal.x) + 10.0, abs(start.y - goal.y) + 10.0
    assert (grid.occupied.shape[1] * 0.05, grid.occupied.shape[0] * 0.05) == pytest.approx((wide, high), abs=0.03)
    assert grid.resolution == 0.05


def test_start_and_goal_may_change_places() -> None:
    here, there = unmapped_grid(Pose2(0.0, 0.0), Pose2(3.0, -2.0)), unmapped_grid(Pose2(3.0, -2.0), Pose2(0.0, 0.0))
    assert (here.origin_x, here.origin_y) == (there.origin_x, there.origin_y) == (-5.0, -7.0)
    assert here.occupied.shape == there.occupied.shape == (240, 260)


@pytest.mark.parametrize(("radius", "yaw"), [(0.3, 0.0), (0.45, math.pi)])
def test_it_has_arrived_nine_tenths_into_the_radius_in_any_heading(radius: float, yaw: float) -> None:
    goal = Pose2(3.0, 0.0)
    for share, state in ((0.85, State.ARRIVED), (0.95, State.FOLLOWING)):
        navigator = unmapped_navigator(Pose2(0.0, 0.0), goal, radius)
        navigator.set_goal(goal, Pose2(goal.x - share * radius, 0.0, yaw))
        assert navigator.step(0.0, Pose2(goal.x - share * radius, 0.0, yaw)).state is state


def test_it_may_go_faster_than_a_robot_that_knows_its_way() -> None:
    limits = unmapped_navigator(Pose2(0.0, 0.0), Pose2(3.0, 0.0), 1.0).follower.limits
    assert (limits.vx_min, limits.vx_max, limits.wz_max) == (-0.5, 1.5, 1.3)


@pytest.mark.parametrize(
    ("tuning", "least"),
    [(WALKING, 0.23 + 0.03), (SHEET, 0.25 + 0.01), (Tuning(Footprint(1.0, 0.6), Margins(tight=0.01)), 0.31)],
)
def test_it_plans_no_nearer_to_things_than_its_outline_and_a_margin(tuning: Tuning, least: float) -> None:
    planner = unmapped_navigator(Pose2(0.0, 0.0), Pose2(3.0, 0.0), 1.0, tuning).planner
    assert planner.tightest == pytest.approx(least, abs=0.011)


def test_the_walking_robot_reaches_farther_back_than_ahead() -> None:
    outline = WALKING.footprint.outline
    assert outline[:, 0].max() == pytest.approx(0.47)
    assert outline[:, 0].min() == pytest.approx(-0.63)
    assert abs(outline[:, 1]).max() == pytest.approx(0.23)
