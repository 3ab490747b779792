"""Walking to goals in simulation: arrive, keep clear, cancel, avoid, wait, recover, fail by name."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, Twist2
from robot.model.footprint import Footprint
from robot.navigation.limits import Limits
from robot.navigation.motion import Motion, State
from robot.navigation.navigator import Navigator
from robot.navigation.navigator_config import NavigatorConfig
from robot.planning.errors import (
    GoalBlocked,
    InvalidPose,
    NavigationError,
    NoProgress,
    PathBlocked,
    StartBlocked,
    Unreachable,
)
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.planning.planner import Planner
from robot.scenes.scene import Box, Cylinder, Scene
from robot.scenes.worlds import get_world
from tests.robot.navigation.navigation_sim import VelocityPlant, body_clearance, random_scene, walk
from tests.robot.stage import floor

MORE = pytest.mark.slow(reason="more widths, densities, sizes and seeds")


def ready(scene: Scene, start: Pose2 | None = None, seed: int = 0) -> tuple[Navigator, VelocityPlant]:
    return Navigator(Grid.from_scene(scene)), VelocityPlant(scene, start or scene.start, seed=seed)


# --- planning ----------------------------------------------------------------------------------------------------------


def test_a_plan_begins_and_ends_exactly_where_asked() -> None:
    scene = get_world("warehouse")
    path = Planner(Grid.from_scene(scene)).plan(Pose2(0.123, 0.456), Pose2(8.012, 5.999))
    assert path.points[0].tolist() == [0.123, 0.456]
    assert path.points[-1].tolist() == [8.012, 5.999]
    assert path.length == pytest.approx(sum(math.dist(a, b) for a, b in itertools.pairwise(path.points)))


@pytest.mark.parametrize(
    ("start", "goal", "error", "words"),
    [
        (Pose2(0, 0), Pose2(2.5, 2.1), GoalBlocked, "nearest obstacle"),
        (Pose2(0, 0), Pose2(50, 0), GoalBlocked, "outside of the map"),
        (Pose2(2.5, 2.1), Pose2(0, 0), StartBlocked, "stands in an obstacle"),
        (Pose2(-50, 0), Pose2(0, 0), StartBlocked, "outside of the map"),
        (Pose2(0, 0), Pose2(math.nan, 0), InvalidPose, "NaN"),
        (Pose2(math.inf, 0), Pose2(0, 0), InvalidPose, "start"),
        (Pose2(0, 0), Pose2(1, 0, math.nan), InvalidPose, "NaN"),
    ],
)
def test_what_cannot_be_planned_is_refused_by_name(
    start: Pose2, goal: Pose2, error: type[NavigationError], words: str
) -> None:
    navigator = Navigator(Grid.from_scene(get_world("warehouse")))
    with pytest.raises(error, match=words) as caught:
        navigator.set_goal(goal, start)
    assert caught.value.name == error.__name__
    assert navigator.state is State.IDLE


def walled_off() -> Scene:
    return dataclasses.replace(
        get_world("empty"), name="cut", obstacles=(Box(2.0, 0.0, 0.2, 20.0),), start=Pose2(0.0, 0.0)
    )


def test_a_goal_behind_a_closed_wall_is_unreachable() -> None:
    with pytest.raises(Unreachable, match=r"no passage of 0\.\d+ m or more joins"):
        Planner(Grid.from_scene(walled_off())).plan(Pose2(0, 0), Pose2(5, 0))


def test_a_goal_at_which_the_body_would_stand_in_a_shelf_is_blocked() -> None:
    navigator = Navigator(Grid.from_scene(get_world("warehouse")))
    navigator.set_goal(Pose2(2.5, -0.4, 0.0))
    with pytest.raises(GoalBlocked, match="the body would touch"):
        navigator.set_goal(Pose2(2.5, -0.4, math.pi / 2))
    assert navigator.goal == Pose2(2.5, -0.4, 0.0), "a refused goal leaves the old one"


def test_a_robot_too_near_to_a_shelf_may_still_begin_there() -> None:
    path = Planner(Grid.from_scene(get_world("warehouse"))).plan(Pose2(2.5, -0.6), Pose2(0.0, 0.0))
    assert path.points[0].tolist() == [2.5, -0.6]


def gap(width: float) -> Scene:
    """Two walls across an empty world with a gap between them at the origin's height."""
    halves = tuple(Box(2.0, side * (5.0 + width / 2), 0.2, 10.0) for side in (-1, 1))
    return dataclasses.replace(
        get_world("empty"), name="gap", bounds=(-2.0, -3.0, 6.0, 3.0), obstacles=halves, start=Pose2(0.0, 0.0)
    )


@pytest.mark.parametrize(
    ("width", "least"),
    [(0.5, 0.52), pytest.param(0.46, 0.48, marks=MORE), pytest.param(0.9, 0.92, marks=MORE)],
)
def test_the_body_is_planned_through_no_gap_that_it_does_not_fit_into(width: float, least: float) -> None:
    footprint = Footprint(width=width)
    for room, fits in ((least - 0.05, False), (least + 0.05, True)):
        navigator = Navigator(Grid.from_scene(gap(room), 0.01), footprint=footprint)
        if fits:
            navigator.set_goal(Pose2(4.0, 0.0), Pose2(0.0, 0.0))
            assert navigator.path is not None
            assert navigator.path.length < 4.1
        else:
            with pytest.raises(Unreachable, match=f"no passage of {least:.2f} m or more"):
                navigator.set_goal(Pose2(4.0, 0.0), Pose2(0.0, 0.0))


@pytest.mark.parametrize("density", [0.20, *(pytest.param(part, marks=MORE) for part in (0.10, 0.15))])
def test_100_random_goals_are_planned_clear_and_not_much_longer_than_needed(density: float) -> None:
    scene = random_scene(seed=1, density=density)
    grid = Grid.from_scene(scene)
    planner, rng = Planner(grid), np.random.default_rng(2)
    ratios: list[float] = []
    start = Pose2(0.0, 0.0)
    while len(ratios) < 100:
        goal = Pose2(*(float(v) for v in rng.uniform(-9.4, 9.4, 2)))
        try:
            path = planner.plan(start, goal)
        except (GoalBlocked, StartBlocked, Unreachable) as error:
            start = goal if isinstance(error, StartBlocked) else start
            continue
        for x, y in path.spaced(0.025).points[20:]:  # it may begin nearer than that
            cell = grid.cell(x, y)
            assert cell is not None
            assert grid.clearance[cell] >= 0.2
        ratios.append(path.length / max(math.hypot(goal.x - start.x, goal.y - start.y), 0.5))
        start = goal
    assert np.median(ratios) < 1.2


# --- walking -----------------------------------------------------------------------------------------------------------


def test_the_patrol_of_the_warehouse_is_walked_with_a_quarter_meter_to_spare() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    for goal in (*scene.patrol, scene.dock):
        navigator.set_goal(goal, walker.pose)
        record = walk(navigator, walker)
        assert record.motion.state is State.ARRIVED
        assert record.error <= 0.10
        assert abs(wrap(walker.pose.yaw - goal.yaw)) <= 0.1
        assert record.clearance >= 0.25
        assert navigator.path is not None
        assert record.distance <= 1.1 * navigator.path.length + 0.2


@pytest.mark.parametrize("world", ["corridor", "pillars"])
def test_the_other_patrols_are_walked_without_contact(world: str) -> None:
    scene = get_world(world)
    navigator, walker = ready(scene, seed=3)
    for goal in scene.patrol:
        navigator.set_goal(goal, walker.pose)
        record = walk(navigator, walker)
        assert record.motion.state is State.ARRIVED
        assert record.clearance >= 0.25


@pytest.mark.parametrize("density", [0.20, *(pytest.param(part, marks=MORE) for part in (0.10, 0.15))])
def test_random_goals_among_random_obstacles_are_reached_without_contact(density: float) -> None:
    scene = random_scene(seed=1, density=density)
    rng = np.random.default_rng(5)

    def somewhere() -> Pose2:
        while True:
            pose = Pose2(*(float(v) for v in rng.uniform(-9.4, 9.4, 2)), float(rng.uniform(-math.pi, math.pi)))
            if body_clearance(scene, pose) > 0.25:
                return pose

    navigator, walker = ready(scene, somewhere())
    arrived = 0
    while arrived < 3:
        try:
            navigator.set_goal(somewhere(), walker.pose)
        except Unreachable:
            continue
        record = walk(navigator, walker, limit=150.0)
        assert record.motion.state is State.ARRIVED
        assert record.clearance > 0.0
        arrived += 1


def test_no_command_ever_leaves_the_limits() -> None:
    scene, limits = get_world("pillars"), Limits(vx_max=0.5, vy_max=0.1, wz_max=0.6)
    navigator, walker = Navigator(Grid.from_scene(scene), limits), VelocityPlant(scene, scene.start)
    commands: list[Motion] = []
    navigator.set_goal(scene.patrol[0], walker.pose)
    record = walk(navigator, walker, hook=lambda _, motion: commands.append(motion))
    assert record.motion.state is State.ARRIVED
    assert all(limits.clip(m.vx, m.vy, m.wz) == Twist2(m.vx, m.vy, m.wz) for m in commands)


def test_four_meters_straight_are_four_meters() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    navigator.set_goal(Pose2(4.0, 0.0), walker.pose)
    assert navigator.path is not None
    assert navigator.path.length == pytest.approx(4.0, abs=0.05)
    assert walk(navigator, walker).distance == pytest.approx(4.0, abs=0.1)


def test_the_remaining_distance_and_the_eta_count_down() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    said: list[Motion] = []
    navigator.set_goal(Pose2(4.0, 0.0), walker.pose)
    walk(navigator, walker, hook=lambda _, motion: said.append(motion))
    distances = [m.distance_remaining for m in said]
    assert distances[0] == pytest.approx(4.0, abs=0.2)
    assert distances[-1] < 0.1
    assert all(b <= a + 0.05 for a, b in itertools.pairwise(distances))
    assert said[0].eta > said[len(said) // 2].eta > said[-1].eta >= 0.0


def test_cancel_commands_a_stop_at_once_and_the_robot_stands_within_half_a_second() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[0], walker.pose)
    walk(navigator, walker, limit=5.0)
    assert walker.velocity.vx > 0.5
    motion = navigator.cancel()
    assert (motion.vx, motion.vy, motion.wz, motion.state) == (0.0, 0.0, 0.0, State.CANCELED)
    walker.advance(Twist2(), 0.5)
    assert abs(walker.velocity.vx) < 0.15, "the simulated body's lag is 0.15 s and its slew 1.5 m/s2"
    later = navigator.step(walker.time, walker.pose, walker.velocity, walker.scan())
    assert (later.vx, later.vy, later.wz, later.state) == (0.0, 0.0, 0.0, State.CANCELED)


def test_a_new_goal_takes_over_within_one_step() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[0], walker.pose)
    walk(navigator, walker, limit=5.0)
    navigator.set_goal(Pose2(0.0, 0.0, 0.0), walker.pose)
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert math.hypot(walker.pose.x, walker.pose.y) <= 0.1


def test_without_a_goal_it_stands() -> None:
    navigator, walker = ready(get_world("empty"))
    motion = navigator.step(0.0, walker.pose, Twist2(), walker.scan())
    assert (motion.vx, motion.vy, motion.wz, motion.state) == (0.0, 0.0, 0.0, State.IDLE)
    assert navigator.cancel().state is State.IDLE


def test_a_scan_is_laid_on_the_map_from_where_it_was_taken() -> None:
    """A box that is on the map is nothing new, though the robot has turned since the scan; seen from the new heading it would be."""
    navigator, walker = ready(floor(Box(3.0, 0.0, 1.0, 1.0)))
    walker.lidar_sd = 0.0
    taken_at, ranges = walker.pose, walker.scan()
    turned = Pose2(taken_at.x, taken_at.y, taken_at.yaw + 0.5)
    navigator.step(0.0, turned, scan=ranges, scanned_at=taken_at)
    assert navigator.around.changes == 0
    navigator.step(0.1, turned, scan=ranges)
    assert navigator.around.changes == 1


def test_a_pose_that_is_no_number_stops_the_robot_until_it_is_one_again() -> None:
    navigator, walker = ready(get_world("empty"))
    navigator.set_goal(Pose2(3.0, 0.0), walker.pose)
    walk(navigator, walker, limit=2.0)
    motion = navigator.step(walker.time, Pose2(math.nan, 0.0), walker.velocity)
    assert (motion.vx, motion.vy, motion.wz, motion.detail) == (0.0, 0.0, 0.0, "no pose")
    assert walk(navigator, walker).motion.state is State.ARRIVED


# --- what the map does not know ----------------------------------------------------------------------------------------


def test_a_box_dropped_on_the_path_is_walked_around() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[0], walker.pose)
    first = navigator.path

    def drop(walker: VelocityPlant, motion: Motion) -> None:
        if walker.pose.x > 2.0 and walker.scene is scene:
            walker.drop(Box(5.0, 0.5, 0.5, 0.5))

    record = walk(navigator, walker, hook=drop)
    assert record.motion.state is State.ARRIVED
    assert record.clearance >= 0.2
    assert isinstance(navigator.path, Path)
    assert navigator.path is not first


def test_when_an_aisle_is_closed_another_one_is_taken() -> None:
    scene = get_world("warehouse")
    navigator, walker = ready(scene, Pose2(0.0, 0.5))
    navigator.set_goal(Pose2(8.8, 0.5), walker.pose)
    walker.drop(Box(7.0, 0.55, 0.4, 2.6))
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert record.distance > 11.0
    assert record.clearance >= 0.25


def closing(scene: Scene, opens_after: float = math.inf) -> object:
    closed_at: list[float] = []

    def hook(walker: VelocityPlant, motion: Motion) -> None:
        if not closed_at and walker.pose.x > 2.0:
            closed_at.append(walker.time)
            walker.drop(Box(6.0, 0.0, 0.4, 1.6))
        if closed_at and walker.time > closed_at[0] + opens_after:
            walker.scene = scene

    return hook


def test_a_closed_corridor_is_waited_at_then_every_recovery_is_tried_then_it_fails_by_name() -> None:
    scene = get_world("corridor")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[1], walker.pose)
    record = walk(navigator, walker, hook=closing(scene))  # type: ignore[arg-type]
    assert record.motion.state is State.FAILED
    assert isinstance(record.motion.failure, PathBlocked)
    assert "tried: clear, back_up, turn, wait" in str(record.motion.failure)
    assert [detail for state, detail in record.states if state is State.RECOVERING] == [
        "clear",
        "back_up",
        "turn",
        "wait",
    ]
    assert (State.WAITING, "blocked") in record.states
    assert record.clearance > 0.05
    assert record.seconds < 40.0
    assert (record.motion.vx, record.motion.vy, record.motion.wz) == (0.0, 0.0, 0.0)


def test_a_corridor_that_opens_again_is_walked_on() -> None:
    scene = get_world("corridor")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[1], walker.pose)
    record = walk(navigator, walker, hook=closing(scene, opens_after=5.0))  # type: ignore[arg-type]
    assert record.motion.state is State.ARRIVED
    assert (State.WAITING, "blocked") in record.states


def with_somebody_on_its_goal() -> tuple[Navigator, VelocityPlant]:
    navigator, walker = ready(get_world("empty"), Pose2(-3.0, 0.0))
    walker.drop(Cylinder(3.0, 0.0, 0.25))
    navigator.set_goal(Pose2(3.0, 0.0), walker.pose)
    return navigator, walker


def test_who_stands_on_a_goal_that_is_far_off_does_not_matter_until_the_robot_is_near() -> None:
    navigator, walker = with_somebody_on_its_goal()

    def leave(walker: VelocityPlant, motion: Motion) -> None:
        if walker.pose.x > 0.0:
            walker.scene = get_world("empty")

    record = walk(navigator, walker, hook=leave)
    assert record.motion.state is State.ARRIVED
    assert State.WAITING not in {state for state, _ in record.states}


def test_who_stays_on_a_goal_is_walked_up_to_waited_for_and_not_touched() -> None:
    navigator, walker = with_somebody_on_its_goal()
    record = walk(navigator, walker)
    assert record.motion.state is State.FAILED
    assert "the goal (3.00, 0.00) has" in str(record.motion.failure)
    assert walker.pose.x > 0.0
    assert record.clearance > 0.3


def test_after_a_failure_a_retry_succeeds_once_the_way_is_open() -> None:
    scene = get_world("corridor")
    navigator, walker = ready(scene)
    navigator.set_goal(scene.patrol[1], walker.pose)
    assert walk(navigator, walker, hook=closing(scene)).motion.state is State.FAILED  # type: ignore[arg-type]
    walker.scene = scene
    navigator.set_goal(scene.patrol[1], walker.pose)
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert record.motion.failure is None


def test_a_robot_that_cannot_move_ends_with_no_progress() -> None:
    scene = get_world("empty")
    navigator, walker = ready(scene)
    navigator.set_goal(Pose2(3.0, 0.0), walker.pose)
    motion = None
    for tick in range(20 * 120):
        motion = navigator.step(tick * 0.05, Pose2(0.0, 0.0), Twist2())
        if motion.state is State.FAILED:
            break
    assert motion is not None
    assert isinstance(motion.failure, NoProgress)
    assert "tried: clear, back_up, turn, wait" in str(motion.failure)


def test_a_new_map_is_planned_on_at_the_next_step() -> None:
    scene = get_world("empty")
    navigator, walker = ready(scene)
    navigator.set_goal(Pose2(6.0, 0.0), walker.pose)
    walk(navigator, walker, limit=1.0)
    navigator.update_map(Grid.from_scene(dataclasses.replace(scene, obstacles=(Box(3.0, 0.0, 0.5, 4.0),))))
    walker.drop(Box(3.0, 0.0, 0.5, 4.0))
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert record.clearance >= 0.25
    assert record.distance > 6.5


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=MORE) for seed in range(2, 6))])
def test_something_crossing_at_half_a_meter_per_second_is_never_touched(seed: int) -> None:
    scene, rng = get_world("empty"), np.random.default_rng(seed)
    navigator, walker = ready(scene, Pose2(-4.0, 0.0), seed=seed)
    navigator.set_goal(Pose2(4.0, 0.0), walker.pose)
    # It would meet the robot, did that not take notice: it crosses the line when the robot would be there, give or take 1 s.
    where, when = rng.uniform(-1.5, 2.5), rng.uniform(-1.0, 1.0)
    when += 1.0 + (where + 4.0) / 0.8
    way, radius = rng.uniform(math.pi / 4, 3 * math.pi / 4) * rng.choice([-1.0, 1.0]), rng.uniform(0.2, 0.35)

    def cross(walker: VelocityPlant, motion: Motion) -> None:
        gone = 0.5 * (walker.time - when)
        mover = Cylinder(where + gone * math.cos(way), gone * math.sin(way), radius)
        walker.scene = dataclasses.replace(scene, obstacles=(mover,))

    record = walk(navigator, walker, hook=cross)
    assert record.motion.state is State.ARRIVED
    assert record.clearance > 0.1


# --- straight on -------------------------------------------------------------------------------------------------------


def test_a_straight_walk_ends_before_what_stands_on_its_line_although_there_is_a_way_round() -> None:
    navigator, walker = ready(get_world("empty"))
    walker.drop(Box(3.0, 0.0, 0.4, 0.4))
    navigator.set_goal(Pose2(6.0, 0.0), walker.pose, straight=True)
    record = walk(navigator, walker)
    assert record.motion.state is State.FAILED
    assert isinstance(record.motion.failure, PathBlocked)
    assert "it was asked not to walk round obstacles" in str(record.motion.failure)
    assert record.clearance > 0.1
    assert abs(walker.pose.y) < 0.05
    assert walker.pose.x > 1.0


def test_a_straight_walk_on_open_floor_arrives_by_the_line() -> None:
    navigator, walker = ready(get_world("empty"))
    navigator.set_goal(Pose2(4.0, 1.0, 1.0), walker.pose, straight=True)
    assert navigator.path is not None
    assert navigator.path.points.tolist() == [[0.0, 0.0], [4.0, 1.0]]
    assert walk(navigator, walker).motion.state is State.ARRIVED


def test_a_straight_goal_outside_of_the_map_is_refused() -> None:
    navigator, walker = ready(get_world("empty"))
    with pytest.raises(GoalBlocked, match="outside of the map"):
        navigator.set_goal(Pose2(40.0, 0.0), walker.pose, straight=True)


def test_a_goal_taken_up_at_speed_is_gone_on_with_at_that_speed() -> None:
    navigator, walker = ready(get_world("empty"))
    navigator.set_goal(Pose2(6.0, 0.0), walker.pose)
    walk(navigator, walker, limit=3.0)
    assert walker.velocity.vx > 0.6
    navigator.cancel()
    navigator.set_goal(Pose2(6.0, 0.5), walker.pose)
    assert navigator.step(walker.time, walker.pose, walker.velocity).vx > 0.5


def test_a_walk_that_sticks_again_after_every_recovery_says_how_many_there_were() -> None:
    navigator = Navigator(Grid.from_scene(get_world("empty")))
    navigator.set_goal(Pose2(9.0, 0.0), Pose2(-9.0, 0.0))
    now, x = 0.0, -9.0
    while navigator.state is not State.FAILED:
        motion = navigator.step(now, Pose2(x, 0.0))
        now += 0.5
        if motion.state is State.RECOVERING:
            navigator.step(now + 3.0, Pose2(x, 0.0))  # its time is over
            now, x = now + 3.5, x + 1.2  # and it has helped
        assert now < 600.0
    assert isinstance(navigator.failure, NoProgress)
    assert str(navigator.failure).endswith("tried: 12 recoveries in all")


def test_a_straight_walk_that_sticks_says_that_it_was_asked_to_go_straight() -> None:
    navigator = Navigator(Grid.from_scene(get_world("empty")))
    navigator.set_goal(Pose2(9.0, 0.0), Pose2(-9.0, 0.0), straight=True)
    for second in range(60):
        motion = navigator.step(0.5 * second, Pose2(-9.0, 0.0))
    assert motion.state is State.FAILED
    assert str(motion.failure).endswith("tried: nothing, as it was asked to go straight")


def test_what_the_config_says_is_what_is_done() -> None:
    few = NavigatorConfig(most_recoveries=1, recovered=0.1)
    navigator = Navigator(Grid.from_scene(get_world("empty")), config=few)
    navigator.set_goal(Pose2(9.0, 0.0), Pose2(-9.0, 0.0))
    for second in range(60):
        motion = navigator.step(0.5 * second, Pose2(-9.0, 0.0))
    assert str(motion.failure).endswith("tried: 1 recoveries in all")


# --- goals inside of what is seen --------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [0.6, pytest.param(1.0, marks=MORE), 3.0])
def test_a_goal_inside_something_unmapped_ends_soon_and_says_so(side: float) -> None:
    world = floor(half=8.0)
    navigator, walker = Navigator(Grid.from_scene(world)), VelocityPlant(world, Pose2(0.0, 0.0))
    walker.drop(Box(5.0, 0.0, side, side))
    navigator.set_goal(Pose2(5.0, 0.0), walker.pose)
    record = walk(navigator, walker, limit=90.0)
    assert record.motion.state is State.FAILED
    assert isinstance(navigator.failure, PathBlocked)
    assert "the goal is inside something that it sees, or closed in by it" in str(navigator.failure)
    assert record.clearance > 0.0
    assert record.distance < 30.0


def test_a_robot_that_walks_round_and_round_gives_up_in_the_end() -> None:
    """It forgets the far side of a thing that it needs longer to walk round than it remembers."""
    world = floor(half=12.0)
    config = NavigatorConfig(near_goal=0.0, most_walked=1.0, aside=5.0)
    navigator, walker = Navigator(Grid.from_scene(world), config=config), VelocityPlant(world, Pose2(0.0, 0.0))
    walker.drop(Box(5.0, 0.0, 2.0, 2.0))
    navigator.set_goal(Pose2(5.0, 0.0), walker.pose)
    record = walk(navigator, walker, limit=90.0)
    assert isinstance(navigator.failure, NoProgress)
    assert "m walked without arriving at the goal" in str(navigator.failure)
    assert record.distance < 25.0
