"""The local controller: what it commands, and what it never does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.control.follow import Follower
from robot.control.limits import Limits
from robot.estimation.local_field import LocalField
from robot.estimation.surroundings import Surroundings
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, Twist2
from robot.model.footprint import Footprint
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.scenes.scene import Box
from robot.scenes.worlds import get_world
from robot.sim.rays import cast
from tests.robot.control.navigation_sim import Walker
from tests.robot.stage import floor

LIMITS = Limits()


def field(*obstacles: Box) -> LocalField:
    return Surroundings(Grid.from_scene(floor(*obstacles, half=10.0))).local_field(Pose2(0, 0))


def straight(*points: tuple[float, float]) -> Path:
    return Path(np.array(points, dtype=np.float64))


def first_step(follower: Follower, pose: Pose2, around: LocalField) -> Twist2:
    return follower.step(pose, around, 0.1).command


def test_a_path_straight_ahead_is_walked_forward() -> None:
    follower = Follower()
    follower.follow(straight((0, 0), (4, 0)), Pose2(4, 0))
    command = first_step(follower, Pose2(0, 0), field())
    assert command.vx > 0.0
    assert command.wz == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("bearing", "sign"), [(1.5, 1.0), (-1.5, -1.0), (3.0, 1.0)])
def test_a_path_to_the_side_is_first_turned_to_on_the_spot(bearing: float, sign: float) -> None:
    follower = Follower()
    follower.follow(straight((0, 0), (4 * math.cos(bearing), 4 * math.sin(bearing))), Pose2(0, 4))
    around = field()
    step = follower.step(Pose2(0, 0), around, 0.1)
    assert step.phase == "turning"
    assert step.command.vx == step.command.vy == 0.0
    assert step.command.wz * sign > 0.0


def test_a_robot_beside_its_path_steps_back_onto_it() -> None:
    follower = Follower()
    follower.follow(straight((0, 0), (6, 0)), Pose2(6, 0))
    command = first_step(follower, Pose2(1.0, -0.15), field())
    assert command.vy > 0.0


def test_in_front_of_an_unseen_turn_of_the_world_it_stops() -> None:
    follower = Follower()
    follower.follow(straight((0, 0), (4, 0)), Pose2(4, 0))
    around = field(Box(0.75, 0, 0.2, 2), Box(-0.75, 0, 0.2, 2), Box(0, 0.4, 2, 0.2), Box(0, -0.4, 2, 0.2))
    step = follower.step(Pose2(0, 0), around, 0.1)
    assert (step.phase, step.command) == ("blocked", Twist2())
    assert step.clearance < 0.1


def test_a_goal_within_reach_is_approached_backward_and_sideways_without_turning_round() -> None:
    follower = Follower()
    for goal in (Pose2(-0.3, 0.0), Pose2(0.0, 0.3), Pose2(0.0, -0.3)):
        follower.halt()
        follower.follow(straight((0, 0), (goal.x, goal.y)), goal)
        command = first_step(follower, Pose2(0, 0), field())
        assert command.vx * goal.x >= 0.0
        assert command.vy * goal.y >= 0.0
        assert abs(command.wz) < 1e-9


def test_at_the_goal_it_says_so_and_stands() -> None:
    follower = Follower()
    follower.follow(straight((1.2, 0), (2, 0)), Pose2(2, 0, 1.0))
    around = field()
    assert follower.step(Pose2(1.98, 0.01, 0.2), around, 0.1).phase == "approaching"
    step = follower.step(Pose2(1.98, 0.01, 0.97), around, 0.1)
    assert (step.phase, step.command) == ("arrived", Twist2())


finite = st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(finite, finite, st.floats(-3.1, 3.1)), min_size=1, max_size=6), st.floats(0.01, 0.2))
def test_no_command_leaves_the_limits_or_jumps_up_faster_than_the_accelerations(
    shifts: list[tuple[float, float, float]], dt: float
) -> None:
    scene = get_world("pillars")
    around = Surroundings(Grid.from_scene(scene))
    follower = Follower(LIMITS)
    follower.follow(straight((-0.8, 0), (1.2, 1.2), (4.8, 0)), Pose2(4.8, 0))
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


def test_the_outline_covers_the_rectangle() -> None:
    footprint = Footprint()
    assert footprint.circumscribed == pytest.approx(0.604, abs=1e-3)
    assert np.abs(footprint.outline).max(axis=0).tolist() == [0.55, 0.25]
    inside = footprint.distances(np.array([0.5, 0.0, 0.85]), np.array([0.2, 0.55, 0.65]))
    assert inside.tolist() == pytest.approx([0.0, 0.3, 0.5])


def test_wrap_lands_in_half_open_turn() -> None:
    assert wrap(math.pi) == math.pi
    assert wrap(-math.pi) == math.pi
    assert wrap(7.0) == pytest.approx(7.0 - 2 * math.pi)


# --- what the LiDAR adds -----------------------------------------------------------------------------------------------


def test_what_the_map_knows_is_not_marked() -> None:
    scene = get_world("warehouse")
    around = Surroundings(Grid.from_scene(scene))
    walker = Walker(scene, scene.start)
    for tick in range(20):
        around.integrate_scan(0.1 * tick, walker.estimate(), walker.scan())
    assert not around.marked.any()


def test_a_new_box_is_marked_where_it_stands_and_forgotten_when_it_is_gone() -> None:
    scene = get_world("warehouse")
    around = Surroundings(Grid.from_scene(scene))
    walker = Walker(scene, scene.start)
    walker.drop(Box(2.0, 0.5, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    rows, columns = np.nonzero(around.marked)
    assert len(rows) > 3
    for row, column in zip(rows, columns, strict=True):
        x, y = around.grid.middle(row, column)
        assert abs(x - 2.0) < 0.3
        assert abs(y - 0.5) < 0.3
    assert around.local_field(walker.pose).clearance(np.array([1.5]), np.array([0.4]))[0] < 0.4
    walker.scene = scene
    around.integrate_scan(0.1, walker.pose, walker.scan())
    assert not around.marked.any()


def test_distances_serve_on_near_their_middle_until_a_mark_changes() -> None:
    scene = get_world("empty")
    around = Surroundings(Grid.from_scene(scene))
    walker = Walker(scene, Pose2(0, 0))
    first = around.local_field(walker.pose)
    assert around.local_field(Pose2(0.9, 0.0), first).fine is first.fine
    assert around.local_field(Pose2(1.1, 0.0), first).fine is not first.fine
    walker.drop(Box(2.0, 0.0, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    x, y = np.array([1.5]), np.array([0.0])
    assert first.clearance(x, y)[0] > 1.0, "an answer that was given does not change any more"
    assert around.local_field(walker.pose, first).clearance(x, y)[0] < 0.4
    other = Surroundings(Grid.from_scene(scene)).local_field(walker.pose, around.local_field(walker.pose))
    assert other.clearance(x, y)[0] > 1.0, "distances of another map do not serve"


def test_a_mark_out_of_sight_is_kept_for_its_memory_only() -> None:
    scene = get_world("empty")
    around = Surroundings(Grid.from_scene(scene), memory=5.0)
    walker = Walker(scene, Pose2(0, 0))
    walker.drop(Box(2.0, 0.0, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    assert around.marked.any()
    blind = np.full(360, 0.9)  # something else close by hides it
    around.integrate_scan(4.0, walker.pose, blind)
    far = np.hypot(*np.meshgrid(*[np.arange(s) * 0.05 - 10.2 for s in around.marked.shape])) > 1.5
    assert around.marked[far].any()
    around.integrate_scan(6.0, walker.pose, blind)
    assert not around.marked[far].any()


def test_a_walking_cylinder_is_seen_to_move_and_a_standing_one_is_not() -> None:
    from robot.scenes.scene import Cylinder

    scene = get_world("empty")
    around = Surroundings(Grid.from_scene(scene))
    for tick in range(15):
        t = 0.1 * tick
        pose = Pose2(0.05 * tick, 0.0)
        obstacles = (Cylinder(4.0, 2.0 - 0.5 * t, 0.25), Cylinder(2.0, -1.5, 0.25), Box(3.0, -3.0, 0.5, 0.5))
        world = replace(scene, obstacles=obstacles)
        around.integrate_scan(t, pose, cast(world, pose.x, pose.y, pose.yaw))
    (mover,) = around.movers.moving
    assert mover.vy == pytest.approx(-0.5, abs=0.1)
    assert mover.vx == pytest.approx(0.0, abs=0.1)
    assert math.hypot(mover.x - 4.0, mover.y - 1.3) < 0.3


def test_a_footprint_that_reaches_farther_back_is_a_rectangle_about_another_middle() -> None:
    footprint = Footprint(length=1.1, width=0.46, ahead=-0.08)
    x, y = footprint.outline.T
    assert (x.min(), x.max()) == pytest.approx((-0.63, 0.47))
    assert (y.min(), y.max()) == pytest.approx((-0.23, 0.23))
    assert footprint.circumscribed == pytest.approx(math.hypot(0.63, 0.23))
    near = footprint.distances(np.array([0.5, -0.7, 0.0]), np.array([0.0, 0.0, 0.33]))
    assert near == pytest.approx([0.03, 0.07, 0.10])
