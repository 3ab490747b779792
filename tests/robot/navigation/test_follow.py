"""The local controller: what it commands, and what it never does."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from robot.geometry.planar import Pose2, Twist2
from robot.navigation.follow import Follower, Step
from robot.navigation.limits import Limits
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.local_field import LocalField
from robot.navigation.rollout import HORIZON, clearances
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.scenes.scene import Box, Cylinder
from robot.scenes.worlds import get_world
from tests.robot.control.kit import field, line

LIMITS = Limits()


def first_step(follower: Follower, pose: Pose2, around: LocalField) -> Twist2:
    return follower.step(pose, around, 0.1).command


def test_a_path_straight_ahead_is_walked_forward() -> None:
    follower = Follower()
    follower.follow(line((0, 0), (4, 0)), Pose2(4, 0))
    command = first_step(follower, Pose2(0, 0), field())
    assert command.vx > 0.0
    assert command.wz == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("bearing", "sign"), [(1.5, 1.0), (-1.5, -1.0), (3.0, 1.0)])
def test_a_path_to_the_side_is_first_turned_to_on_the_spot(bearing: float, sign: float) -> None:
    follower = Follower()
    follower.follow(line((0, 0), (4 * math.cos(bearing), 4 * math.sin(bearing))), Pose2(0, 4))
    around = field()
    step = follower.step(Pose2(0, 0), around, 0.1)
    assert step.phase == "turning"
    assert step.command.vx == step.command.vy == 0.0
    assert step.command.wz * sign > 0.0


def test_a_robot_beside_its_path_steps_back_onto_it() -> None:
    follower = Follower()
    follower.follow(line((0, 0), (6, 0)), Pose2(6, 0))
    command = first_step(follower, Pose2(1.0, -0.15), field())
    assert command.vy > 0.0


def test_in_front_of_an_unseen_turn_of_the_world_it_stops() -> None:
    follower = Follower()
    follower.follow(line((0, 0), (4, 0)), Pose2(4, 0))
    around = field(Box(0.75, 0, 0.2, 2), Box(-0.75, 0, 0.2, 2), Box(0, 0.4, 2, 0.2), Box(0, -0.4, 2, 0.2))
    step = follower.step(Pose2(0, 0), around, 0.1)
    assert (step.phase, step.command) == ("blocked", Twist2())
    assert step.clearance < 0.1


def test_a_goal_within_reach_is_approached_backward_and_sideways_without_turning_round() -> None:
    follower = Follower()
    for goal in (Pose2(-0.3, 0.0), Pose2(0.0, 0.3), Pose2(0.0, -0.3)):
        follower.halt()
        follower.follow(line((0, 0), (goal.x, goal.y)), goal)
        command = first_step(follower, Pose2(0, 0), field())
        assert command.vx * goal.x >= 0.0
        assert command.vy * goal.y >= 0.0
        assert abs(command.wz) < 1e-9


def test_at_the_goal_it_says_so_and_stands() -> None:
    follower = Follower()
    follower.follow(line((1.2, 0), (2, 0)), Pose2(2, 0, 1.0))
    around = field()
    assert follower.step(Pose2(1.98, 0.01, 0.2), around, 0.1).phase == "approaching"
    step = follower.step(Pose2(1.98, 0.01, 0.97), around, 0.1)
    assert (step.phase, step.command) == ("arrived", Twist2())


finite = st.floats(-1.0, 1.0)


@given(st.lists(st.tuples(finite, finite, st.floats(-3.1, 3.1)), min_size=1, max_size=6), st.floats(0.01, 0.2))
def test_no_command_leaves_the_limits_or_jumps_up_faster_than_the_accelerations(
    shifts: list[tuple[float, float, float]], dt: float
) -> None:
    scene = get_world("pillars")
    around = LocalCostmap(Grid.from_scene(scene))
    follower = Follower(LIMITS)
    follower.follow(line((-0.8, 0), (1.2, 1.2), (4.8, 0)), Pose2(4.8, 0))
    last = Twist2()
    for dx, dy, yaw in shifts:
        pose = Pose2(dx, dy, yaw)
        command = follower.step(pose, around.local_field(pose), dt).command
        assert LIMITS.vx_min <= command.vx <= LIMITS.vx_max
        assert abs(command.vy) <= LIMITS.vy_max
        assert abs(command.wz) <= LIMITS.wz_max
        for now, before, rate in (
            (command.vx, last.vx, LIMITS.acceleration),
            (command.vy, last.vy, LIMITS.acceleration),
            (command.wz, last.wz, LIMITS.turn_acceleration),
        ):
            assert abs(now) <= abs(before) + rate * dt + 1e-9
        last = command


# -- the wish along a path ----------------------------------------------------------------------------------------------------

OPEN = field()
LONG = 100.0
"""Seconds of a step in which any speed can be reached: the command itself, without its ramp."""


def wish(pose: Pose2, *points: tuple[float, float], around: LocalField = OPEN) -> Step:
    follower = Follower()
    follower.follow(line(*points), Pose2(*points[-1]))
    return follower.step(pose, around, LONG)


@given(x=st.floats(0.2, 0.9), y=st.floats(-0.15, 0.15), yaw=st.floats(-0.3, 0.3))
@settings(max_examples=40)
def test_in_the_open_the_command_is_that_of_the_equations(x: float, y: float, yaw: float) -> None:
    step = wish(Pose2(x, y, yaw), (0.0, 0.0), (8.0, 0.0))
    bearing = math.atan2(-y, 0.35) - yaw
    assume(abs(bearing) < 0.69)
    assert step.phase == "following"
    assert step.command.wz == pytest.approx(np.clip(1.8 * bearing, -1.0, 1.0), abs=1e-9)
    assert step.command.vy == pytest.approx(np.clip(0.8 * math.cos(yaw) * -y, -0.3, 0.3), abs=1e-9)
    assert step.command.vx == pytest.approx(0.8 * max(math.cos(1.4 * bearing), 0.2), abs=1e-9)


def test_the_point_that_is_pursued_lies_farther_ahead_at_speed() -> None:
    slow, fast = Follower(), Follower()
    for follower in (slow, fast):
        follower.follow(line((0.0, 0.0), (8.0, 0.0)), Pose2(8.0, 0.0))
    fast.take_up(Twist2(0.8, 0.0, 0.0))
    pose = Pose2(1.0, 0.2)
    for follower, ahead in ((slow, 0.35), (fast, 0.35 + 0.5 * 0.8)):
        assert follower.step(pose, OPEN, LONG).command.wz == pytest.approx(1.8 * math.atan2(-0.2, ahead), abs=1e-9)


@pytest.mark.parametrize("left", [0.5, 0.6, 0.8, 1.5])
def test_towards_the_goal_it_brakes_at_four_tenths_of_a_metre_per_second_squared(left: float) -> None:
    speed = wish(Pose2(4.0 - left, 0.0), (3.5 - left, 0.0), (4.0, 0.0)).command.vx
    assert speed == pytest.approx(min(0.8, math.sqrt(2 * 0.4 * (left + 0.06 - 0.21))))


def test_a_turn_on_the_spot_begins_beyond_seven_tenths_of_a_radian_and_goes_down_to_two() -> None:
    follower = Follower()
    follower.follow(line((0.0, 0.0), (8.0, 0.0)), Pose2(8.0, 0.0))
    phases = [follower.step(Pose2(1.0, 0.0, yaw), OPEN, 0.05).phase for yaw in (0.65, 0.75, 0.5, 0.25, 0.15, 0.5)]
    assert phases == ["following", "turning", "turning", "turning", "following", "following"]


@pytest.mark.parametrize("gap", [0.1, 0.2, 0.4])
def test_the_less_room_the_slower_it_walks(gap: float) -> None:
    walls = (Box(0.0, 0.25 + gap + 0.5, 12.0, 1.0), Box(0.0, -0.25 - gap - 0.5, 12.0, 1.0))
    step = wish(Pose2(0.0, 0.0), (-0.5, 0.0), (4.0, 0.0), around=field(*walls))
    assert step.command.vx == pytest.approx(min(0.8, 0.3 + 2.0 * (step.clearance - 0.06)))
    assert step.clearance == pytest.approx(gap, abs=0.06)


# -- the last steps -----------------------------------------------------------------------------------------------------------


@given(x=st.floats(-0.25, 0.25), y=st.floats(-0.25, 0.25), yaw=st.floats(-3.0, 3.0), heading=st.floats(-0.5, 0.5))
@settings(max_examples=40)
def test_near_the_goal_it_goes_straight_there_within_its_limits(x: float, y: float, yaw: float, heading: float) -> None:
    assume(math.hypot(x, y) > 0.1)
    follower = Follower()
    follower.follow(line((x + 0.01, y), (x, y)), Pose2(x, y, yaw + heading))
    step = follower.step(Pose2(0.0, 0.0, yaw), OPEN, LONG)
    c, s = math.cos(yaw), math.sin(yaw)
    way = np.array((c * x + s * y, c * y - s * x))
    asked = way * min(1.2, 0.35 / np.linalg.norm(way))
    asked = asked / max(1.0, asked[0] / 0.8, -asked[0] / 0.3, abs(asked[1]) / 0.3)
    assert step.phase == "approaching"
    assert (step.command.vx, step.command.vy) == pytest.approx(asked, abs=1e-9)
    assert step.command.wz == pytest.approx(1.25 * 1.2 * heading, abs=1e-9)


@pytest.mark.parametrize(
    ("off", "turn", "phase"),
    [(0.05, 0.03, "arrived"), (0.07, 0.03, "approaching"), (0.05, 0.05, "approaching"), (-0.05, -0.03, "arrived")],
)
def test_it_has_arrived_within_the_tolerance_and_no_farther(off: float, turn: float, phase: str) -> None:
    follower = Follower()
    follower.follow(line((0.0, 0.0), (2.0, 0.0)), Pose2(2.0, 0.0))
    for x in (1.0, 1.8):
        follower.step(Pose2(x, 0.0), OPEN, 0.1)
    assert follower.step(Pose2(2.0 + off, 0.0, turn), OPEN, 0.1).phase == phase


# -- choosing among commands --------------------------------------------------------------------------------------------------

POSTS = (Cylinder(1.0, 0.12, 0.15), Cylinder(2.2, -0.5, 0.2))


def chosen(pose: Pose2, path: Path, goal: Pose2, *things: Box | Cylinder) -> Step:
    follower = Follower()
    follower.follow(path, goal)
    return follower.step(pose, field(*things, at=pose), LONG)


@pytest.mark.parametrize("y", [0.0, 0.1, -0.2])
def test_how_many_points_a_path_has_does_not_matter_only_where_it_leads(y: float) -> None:
    """Points beside the others, as bends add them, are no way."""
    every = np.arange(0.0, 1.0, 0.05)
    crowded = np.union1d(every, every + 0.001).tolist()
    paths = (line((0.0, 0.0), (5.0, 0.0)), line(*((x, 0.0) for x in crowded), (5.0, 0.0)))
    plain, other = (chosen(Pose2(0.0, y), path, Pose2(5.0, 0.0), *POSTS) for path in paths)
    assert plain.phase == "avoiding"
    assert other == plain


@pytest.mark.parametrize("seed", range(8))
def test_every_piece_of_the_path_that_is_followed_has_the_direction_of_the_path(seed: int) -> None:
    """Where a corner falls on a multiple of the spacing but for rounding, it stays one point."""
    lengths = np.random.default_rng(seed).integers(1, 60, 6) * 0.05
    corners = np.cumsum(
        [(0.0, 0.0), *((d, 0.0) if k % 2 else (0.0, d) for k, d in enumerate(lengths.tolist()))], axis=0
    )
    follower = Follower()
    follower.follow(Path(corners), Pose2(*corners[-1].tolist()))
    pieces = np.diff(follower.ahead(math.inf), axis=0)
    assert np.hypot(*pieces.T).min() > 1e-6
    assert np.hypot(*pieces.T).max() <= 0.05 + 1e-9
    assert np.abs(pieces).min(axis=1) == pytest.approx(np.zeros(len(pieces)), abs=1e-9)
    assert np.hypot(*pieces.T).sum() == pytest.approx(lengths.sum(), abs=0.05)


@pytest.mark.parametrize("y", [0.05, 0.1, -0.2])
def test_in_a_mirrored_world_it_does_the_mirrored_thing(y: float) -> None:
    path, goal = line((0.0, 0.0), (5.0, 0.0)), Pose2(5.0, 0.0)
    plain = chosen(Pose2(0.0, y, 0.1), path, goal, *POSTS)
    image = chosen(Pose2(0.0, -y, -0.1), path, goal, *(Cylinder(p.x, -p.y, p.radius) for p in POSTS))
    assert plain.phase == image.phase == "avoiding"
    assert (image.command.vx, image.command.vy, image.command.wz) == pytest.approx(
        (plain.command.vx, -plain.command.vy, -plain.command.wz)
    )
    assert image.clearance == pytest.approx(plain.clearance)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_in_a_world_turned_by_a_quarter_it_does_the_same(quarters: int) -> None:
    def turn(x: float, y: float) -> tuple[float, float]:
        for _ in range(quarters):
            x, y = -y, x
        return x, y

    plain = chosen(Pose2(0.0, 0.05), line((0.0, 0.0), (5.0, 0.0)), Pose2(5.0, 0.0), *POSTS)
    yaw = quarters * math.pi / 2
    posts = (Cylinder(*turn(p.x, p.y), p.radius) for p in POSTS)
    path = line((0.0, 0.0), turn(5.0, 0.0))
    turned = chosen(Pose2(*turn(0.0, 0.05), yaw), path, Pose2(*turn(5.0, 0.0), yaw), *posts)
    assert turned.phase == plain.phase
    assert dataclasses.astuple(turned.command) == pytest.approx(dataclasses.astuple(plain.command), abs=1e-9)


@given(x=st.floats(0.9, 2.5), y=st.floats(-0.6, 0.6), yaw=st.floats(-0.5, 0.5))
@settings(max_examples=30)
def test_no_command_that_it_gives_leads_the_body_nearer_than_the_least(x: float, y: float, yaw: float) -> None:
    around, pose = field(Cylinder(x, y, 0.15)), Pose2(0.0, 0.0, yaw)
    follower = Follower()
    follower.follow(line((0.0, 0.0), (5.0, 0.0)), Pose2(5.0, 0.0))
    step = follower.step(pose, around, LONG)
    command = np.array([dataclasses.astuple(step.command)])
    assert clearances(pose, command, around, HORIZON).min() >= min(0.06, step.clearance - 0.011)


# -- what it remembers --------------------------------------------------------------------------------------------------------


def test_halted_it_has_no_path_and_no_speed_and_halting_the_speed_keeps_the_path() -> None:
    follower = Follower()
    follower.follow(line((0.0, 0.0), (8.0, 0.0)), Pose2(8.0, 0.0))
    follower.take_up(Twist2(0.8, 0.0, 0.0))
    assert follower.step(Pose2(1.0, 0.0), OPEN, 0.05).command.vx == pytest.approx(0.8)
    follower.halt_speed()
    assert follower.step(Pose2(1.0, 0.0), OPEN, 0.05).command.vx == pytest.approx(0.05)
    follower.halt()
    assert follower.path is None


def test_poses_are_gone_through_one_after_the_other_and_then_the_path_again() -> None:
    follower = Follower()
    follower.follow(line((0.0, 0.0), (8.0, 0.0)), Pose2(8.0, 0.0))
    poses = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.linspace(0.0, 0.5, 11)])
    follower.follow_poses(poses)
    assert follower.threading
    first = follower.step(Pose2(0.0, 0.0), OPEN, LONG)
    assert first.phase == "threading"
    assert first.command.wz > 0.0
    phases = [follower.step(Pose2(x, 0.0, 0.5 * x), OPEN, 0.05).phase for x in (0.3, 0.6, 0.8, 0.95)]
    assert phases == ["threading"] * 3 + ["following"]
    assert not follower.threading
    follower.follow_poses(poses)
    follower.drop_poses()
    assert not follower.threading


def test_the_poses_of_a_gap_outlive_a_new_path_only_where_they_are_still_open() -> None:
    poses = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11)])
    for around, kept in ((OPEN, True), (field(Box(1.2, 0.0, 0.2, 0.2)), False), (None, False)):
        follower = Follower()
        follower.follow(line((0.0, 0.0), (8.0, 0.0)), Pose2(8.0, 0.0))
        follower.follow_poses(poses)
        follower.follow(line((0.0, 0.0), (7.0, 0.0)), Pose2(7.0, 0.0), around)
        assert follower.threading is kept


def test_the_narrowest_place_ahead_is_where_the_walls_come_closest() -> None:
    around = field(Cylinder(1.5, 0.6, 0.1), Cylinder(0.5, -0.9, 0.1))
    follower = Follower()
    follower.follow(line((0.0, 0.0), (4.0, 0.0)), Pose2(4.0, 0.0))
    clear, x, y = follower.narrowest(around, 2.5)
    assert clear == pytest.approx(0.25, abs=0.06)
    assert abs(x - 1.5) <= 0.6
    assert y == 0.0
    assert follower.narrowest(around, 0.05)[0] == math.inf


@pytest.mark.parametrize(("gap", "tight"), [(0.05, True), (0.25, False)])
def test_a_passage_in_which_the_body_hardly_fits_is_tight(gap: float, tight: bool) -> None:
    walls = (Box(0.5, 0.25 + gap + 0.5, 2.0, 1.0), Box(0.5, -0.25 - gap - 0.5, 2.0, 1.0))
    follower = Follower()
    follower.follow(line((-1.0, 0.0), (4.0, 0.0)), Pose2(4.0, 0.0))
    assert follower.is_tight(Pose2(-1.0, 0.0), field(*walls)) is tight
