"""The tutorials' three walking actions on the real robot's navigator: results, cancel, preemption, refusals (kinematic body, virtual time)."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from actors import Child, GoalAborted, GoalCanceled, GoalRejected, GoalStatus, Node, QoS, every
from actors.qos import Reliability
from actors.testing import Rig
from robot.contracts import (
    AUTONOMY_CMD,
    CAMERA_RGB,
    CMD_VEL,
    GET_PLACE,
    GET_ROBOT_POSE,
    HUMANOID_NAVIGATE,
    LOCALIZATION,
    MOVE_TO_POSITION,
    NAVIGATE_TO_GOAL,
    ODOMETRY,
    PATH,
    PLAN_PATH,
    POSE,
    SCAN,
)
from robot.geometry.angles import wrap
from robot.interfaces.robactor_msgs.srv import GetPlace
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose
from robot.interfaces.tutorials.your_package.action import HumanoidNav
from robot.nodes.camera import Camera
from robot.nodes.lidar import Lidar
from robot.sim.devices import SimulatedCamera
from tests.robot.stage import (
    floor,
    humanoid,
    localized_robot,
    move,
    navigate,
    speed,
    standing_robot,
    true_pose,
)

BEST_EFFORT = QoS(depth=1000, reliability=Reliability.BEST_EFFORT)
ACTIONS = ((NAVIGATE_TO_GOAL, navigate), (MOVE_TO_POSITION, move), (HUMANOID_NAVIGATE, humanoid))


# -- arriving -----------------------------------------------------------------------------------------------------------


async def test_four_meters_straight_are_four_meters_and_progress_only_grows(rig: Rig) -> None:
    await standing_robot(rig)
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(4.0, 0.0))
    said = [feedback async for feedback in going]
    result = await going
    assert (result.success, result.message) == (True, "Goal reached")
    assert result.total_distance == pytest.approx(4.0, abs=0.1)
    progress = [feedback.progress_percent for feedback in said]
    assert all(a <= b for a, b in pairwise(progress))
    assert progress[0] < 5.0
    assert progress[-1] > 97.0
    assert said[-1].current_pose.header.frame_id == "map"


async def test_a_walk_that_has_arrived_or_was_canceled_leaves_no_path_behind_and_one_that_was_preempted_the_next_one(
    rig: Rig,
) -> None:
    await standing_robot(rig)
    plans = rig.probe(PATH)
    assert (await (await rig.send_goal(NAVIGATE_TO_GOAL, navigate(1.0, 0.0)))).success
    await rig.advance(0.1)
    walked, over = plans
    assert walked.poses and not over.poses and over.header.frame_id == "map"

    await rig.send_goal(MOVE_TO_POSITION, move(0.0, 0.0))
    await rig.advance(1.0)
    second = await rig.send_goal(MOVE_TO_POSITION, move(2.0, 0.0))
    await rig.advance(1.0)
    assert [bool(plan.poses) for plan in plans] == [True, False, True, True]
    assert plans[-1].poses[-1].pose.position.x == pytest.approx(2.0, abs=0.05)
    await second.cancel()
    await rig.advance(0.5)
    assert not plans[-1].poses
    late = rig.probe(PATH)
    await rig.advance(0.1)
    assert [bool(plan.poses) for plan in late] == [False]  # who comes later is told, too


class FadingLidar(Lidar):
    """It can fall silent."""

    silent = False

    @every(hz=10)
    def turn(self) -> None:
        if not self.silent:
            super().turn()


async def test_without_a_lidar_the_robot_walks_slowly_says_so_and_is_as_fast_as_before_when_it_is_back(
    rig: Rig,
) -> None:
    body = await standing_robot(rig, floor(), lidar=FadingLidar)
    lidar = rig.node(FadingLidar)
    handle = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.0, 0.0))
    await rig.advance(3.0)
    assert speed(body) == pytest.approx(0.7, abs=0.02)
    lidar.silent = True
    await rig.advance(1.5)
    fastest = 0.0
    for _ in range(20):
        await rig.advance(0.1)
        fastest = max(fastest, speed(body))
    assert fastest == pytest.approx(0.2, abs=0.01)
    lidar.silent = False
    await rig.advance(2.0)
    assert speed(body) == pytest.approx(0.7, abs=0.02)
    assert (await handle).success
    said = [line.event for line in rig.logs if line.node == "/navigation" and "LiDAR" in line.event]
    assert said == ["no LiDAR: walking slowly", "LiDAR again: walking as before"]


async def test_with_a_lidar_that_sees_no_wall_where_the_map_has_them_the_robot_walks_slowly(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = await standing_robot(rig)
    states = rig.probe(LOCALIZATION)
    await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.0, 0.0))
    await rig.advance(2.0)
    assert speed(body) == pytest.approx(0.7, abs=0.02)
    monkeypatch.setattr(body, "lidar", lambda beams, reach: np.full(beams, reach))  # its window is covered
    await rig.advance(3.5)
    assert states.newest.data == "blind"
    assert speed(body) == pytest.approx(0.2, abs=0.02)


async def test_the_robot_ends_with_the_heading_that_was_asked_for(rig: Rig) -> None:
    body = await standing_robot(rig)
    going = await rig.send_goal(MOVE_TO_POSITION, move(2.0, 0.5, 2.0))
    result = await going
    here = true_pose(body)
    assert result.message == "Reached target position"
    assert abs(wrap(here.yaw - 2.0)) <= 0.05
    assert math.hypot(here.x - 2.0, here.y - 0.5) <= 0.1
    assert (result.final_x, result.final_y) == pytest.approx((here.x, here.y), abs=0.05)
    assert 2.0 < result.total_time_seconds < 20.0


async def test_two_humanoid_goals_in_a_row_and_every_position_is_the_true_one(rig: Rig) -> None:
    body = await standing_robot(rig)
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(2.0, 0.0, 1.0))
    said, headings = [], []
    async for feedback in going:
        said.append(feedback)
        headings.append((feedback.current_position[2], true_pose(body).yaw))
    result = await going
    here = true_pose(body)
    assert result.success
    assert result.final_position.tolist() == pytest.approx([here.x, here.y, here.yaw], abs=0.05)
    assert abs(wrap(here.yaw - 1.0)) <= 0.07, "the heading is reached, not claimed"
    assert max(abs(wrap(told - true)) for told, true in headings) < 0.1
    assert max(true for _, true in headings) > 0.3, "it is told while the robot turns, too"
    assert [feedback.current_waypoint for feedback in said] == [10 * (k + 1) for k in range(len(said))]
    assert said[0].status_message == f"Navigating... {said[0].distance_remaining:.2f}m to go"
    second = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(3.0, 0.5))
    first_said = await anext(second)
    x, y, _ = first_said.current_position.tolist()
    assert math.hypot(x - here.x, y - here.y) < 0.9, "it goes on from where it is"
    assert (await second).success


async def test_a_goal_where_it_stands_is_reached_at_once_with_one_feedback(rig: Rig) -> None:
    await standing_robot(rig)
    begun = rig.now
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(0.05, 0.0))
    said = [feedback async for feedback in going]
    assert (await going).success
    assert len(said) == 1
    assert rig.now - begun < 0.2


async def test_a_short_walk_gives_a_feedback_too(rig: Rig) -> None:
    await standing_robot(rig)
    going = await rig.send_goal(HUMANOID_NAVIGATE, humanoid(0.25, 0.0))
    assert len([feedback async for feedback in going]) >= 1
    assert (await going).success


# -- refusing -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
async def test_a_goal_that_is_no_place_is_rejected_and_nothing_moves(rig: Rig, value: float) -> None:
    body = await standing_robot(rig)
    before, commands = true_pose(body), rig.probe(AUTONOMY_CMD)
    for action, goal in ACTIONS:
        with pytest.raises(GoalRejected, match=r"NaN|finite"):
            await rig.send_goal(action, goal(value, 1.0))
    await rig.advance(0.5)
    assert true_pose(body) == before
    assert not any(message.linear.x for message in commands)


async def test_a_target_of_two_numbers_is_rejected(rig: Rig) -> None:
    await standing_robot(rig)
    with pytest.raises(GoalRejected, match="three finite numbers"):
        await rig.send_goal(HUMANOID_NAVIGATE, HumanoidNav.Goal(target_position=[1.0, 2.0], avoid_obstacles=True))


async def test_an_unknown_frame_is_rejected_with_the_remedy(rig: Rig) -> None:
    await standing_robot(rig)
    with pytest.raises(GoalRejected, match="unknown frame 'moon': give the goal in frame 'map'"):
        await rig.send_goal(NAVIGATE_TO_GOAL, navigate(1.0, 0.0, frame="moon"))


async def test_a_goal_inside_a_shelf_is_refused_by_name_within_two_seconds(rig: Rig) -> None:
    await standing_robot(rig)
    begun = rig.now
    for action, goal in ACTIONS:
        with pytest.raises(GoalRejected, match=r"GoalBlocked: the goal .* nearest obstacle"):
            await rig.send_goal(action, goal(2.5, 2.1))
    assert rig.now - begun < 2.0


# -- canceling --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", range(3))
async def test_cancel_commands_zero_within_a_tenth_of_a_second_and_the_robot_stops(rig: Rig, which: int) -> None:
    body, topic = (await standing_robot(rig), AUTONOMY_CMD) if which else (await localized_robot(rig), CMD_VEL)
    action, goal = ACTIONS[which]
    going = await rig.send_goal(action, goal(8.8, 0.5))
    await rig.advance(6.0)
    assert speed(body) > 0.5
    commands, asked = rig.probe(topic), rig.now
    assert await going.cancel()
    await rig.until(lambda: going.done, within=0.1)
    await rig.until(
        lambda: len(commands) > 0 and commands[-1].linear.x == 0.0, within=max(0.1 - (rig.now - asked), 0.0)
    )
    await rig.advance(0.5 - (rig.now - asked))
    assert speed(body) < 0.2, "braking at 1.5 m/s2 with the body's lag of 0.15 s"
    await rig.advance(0.5)
    assert speed(body) < 0.02
    here = true_pose(body)
    with pytest.raises(GoalCanceled) as canceled:
        await going
    result = canceled.value.result
    assert not result.success
    if which == 1:
        assert result.message == "Movement canceled"
        assert math.hypot(result.final_x - here.x, result.final_y - here.y) < 0.5
        assert result.total_time_seconds == pytest.approx(6.0, abs=0.2)
    if which == 2:
        assert math.hypot(result.final_position[0] - here.x, result.final_position[1] - here.y) < 0.5
    count = going.feedback_count
    await rig.advance(1.0)
    assert going.feedback_count == count
    assert all(message.linear.x == 0.0 for message in commands)


async def test_canceling_an_ended_goal_does_nothing_to_the_next_one(rig: Rig) -> None:
    await standing_robot(rig)
    first = await rig.send_goal(MOVE_TO_POSITION, move(0.6, 0.0))
    assert (await first).success
    second = await rig.send_goal(MOVE_TO_POSITION, move(1.5, 0.0))
    await rig.advance(0.5)
    assert not await first.cancel()
    assert (await second).success


async def test_a_cancel_at_the_instant_of_arrival_leaves_one_outcome(rig: Rig) -> None:
    await standing_robot(rig)
    going = await rig.send_goal(MOVE_TO_POSITION, move(0.6, 0.0))
    await rig.until(lambda: going.done)
    assert not await going.cancel()
    assert (await going.ended()).status is GoalStatus.SUCCEEDED


# -- preempting -------------------------------------------------------------------------------------------------------------


async def test_a_goal_of_any_action_preempts_one_of_any_other_and_the_robot_does_not_stop_between(
    rig: Rig,
) -> None:
    body = await standing_robot(rig)
    order = [first for pair in ((0, 0), (1, 1), (2, 2), (0, 2), (1, 0)) for first in pair]
    last = None
    for turn, which in enumerate(order):
        action, goal = ACTIONS[which]
        commands = rig.probe(AUTONOMY_CMD)
        one = await rig.send_goal(action, goal(8.8, 0.2 + 0.05 * turn))
        if last is not None:
            with pytest.raises((GoalCanceled, GoalAborted), match="preempted by a newer goal"):
                await last
            assert (await last.ended()).status in (GoalStatus.CANCELED, GoalStatus.ABORTED)
            await rig.until(lambda heard=commands: any(c.linear.x > 0.3 for c in heard), within=0.11)
            assert speed(body) > 0.5
        await rig.advance(1.5 if last is None else 0.5)
        last = one
    assert last is not None
    assert (await last).success


async def test_preempted_at_two_seconds_the_first_goal_fails_and_the_second_is_reached(rig: Rig) -> None:
    body = await standing_robot(rig)
    one = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(3.0, 4.0))
    await rig.advance(2.0)
    two = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(0.0, 0.0))
    with pytest.raises((GoalCanceled, GoalAborted), match="preempted"):
        await one
    assert (await two).success
    here = true_pose(body)
    assert math.hypot(here.x, here.y) < 0.1


async def test_a_client_that_vanishes_cancels_its_goal_and_leaves_the_server_free(rig: Rig) -> None:
    await standing_robot(rig)
    async with rig.me.send_goal(MOVE_TO_POSITION, move(4.0, 0.0)) as going:
        await rig.advance(2.0)
    assert (await going.ended()).status is GoalStatus.CANCELED
    again = await rig.send_goal(MOVE_TO_POSITION, move(0.5, 0.0))
    assert (await again).success


# -- meanwhile ----------------------------------------------------------------------------------------------------------------


class Metronome(Node):
    """100 ticks a second on the robot's own loop."""

    def __init__(self) -> None:
        self.ticks = 0

    @every(hz=100)
    def tick(self) -> None:
        self.ticks += 1


async def test_during_a_walk_topics_keep_their_rates_and_the_pose_is_told_at_once(rig: Rig) -> None:
    body = await localized_robot(rig)
    await rig.system.join(Child(Metronome))
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.8, 0.5))
    await rig.advance(3.0)
    odometry, poses, ticks = rig.probe(ODOMETRY, qos=1000), rig.probe(POSE, qos=1000), rig.node(Metronome).ticks
    for _ in range(10):
        await rig.advance(0.5)
        asked = rig.now
        reply = await rig.call(GET_ROBOT_POSE, GetRobotPose.Request())
        assert rig.now - asked < 0.05
        here = true_pose(body)
        assert reply.success
        assert reply.pose.header.frame_id == "map"
        assert math.hypot(reply.pose.pose.position.x - here.x, reply.pose.pose.position.y - here.y) < 0.1
    assert not going.done
    assert abs(len(odometry) - 250) <= 3
    assert abs(len(poses) - 250) <= 3
    assert rig.node(Metronome).ticks - ticks >= 495


async def test_the_warehouse_robot_asks_where_shelf_3_is_and_walks_there(rig: Rig) -> None:
    body = await standing_robot(rig)
    place = await rig.call(GET_PLACE, GetPlace.Request(name="shelf_3"))
    assert place.success
    await rig.system.join(Child(Camera, args=(SimulatedCamera(body),)))
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(place.pose.pose.position.x, place.pose.pose.position.y))
    await rig.advance(2.0)
    images, scans = (rig.probe(topic, qos=BEST_EFFORT) for topic in (CAMERA_RGB, SCAN))
    await rig.advance(3.0)
    assert not going.done
    assert len(images) >= 0.98 * 90
    assert len(scans) >= 0.98 * 30
    said = [feedback async for feedback in going]
    assert (await going).success
    assert len(said) > 5
    here = true_pose(body)
    assert math.hypot(here.x - place.pose.pose.position.x, here.y - place.pose.pose.position.y) < 0.1


async def test_a_place_that_is_not_on_the_map_is_answered_with_the_closest_names(rig: Rig) -> None:
    await standing_robot(rig)
    reply = await rig.call(GET_PLACE, GetPlace.Request(name="shelf3"))
    assert not reply.success
    assert "no place called 'shelf3'; did you mean shelf_3" in reply.message
    nothing = await rig.call(GET_PLACE, GetPlace.Request(name="the moon"))
    assert "there are: shelf_1" in nothing.message


async def test_a_planned_path_starts_at_the_start_and_ends_at_the_goal(rig: Rig) -> None:
    await standing_robot(rig)
    start, goal = navigate(0.1, 0.2).target_pose, navigate(8.0, 6.0).target_pose
    reply = await rig.call(PLAN_PATH, PlanPath.Request(start=start, goal=goal))
    assert (reply.success, reply.message) == (True, "Path planned successfully")
    assert reply.path.header.frame_id == "map"
    assert reply.path.poses[0].pose.position == start.pose.position
    assert reply.path.poses[-1].pose.position == goal.pose.position
    refused = await rig.call(PLAN_PATH, PlanPath.Request(start=start, goal=navigate(2.5, 2.1).target_pose))
    assert (refused.success, refused.path.poses) == (False, ())
    assert refused.message.startswith("GoalBlocked: ")
