"""What Nav2's clients and RViz ask of the robot: /navigate_to_pose, /navigate_through_poses, /goal_pose, /initialpose (kinematic body, virtual time)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from actors import Aborted, Child, Done, GoalAborted, GoalCanceled, GoalRejected, GoalStatus, Node, Steps
from actors.interfaces.geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from actors.interfaces.nav_msgs.msg import Goals, OccupancyGrid
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger_Request, Trigger_Response
from actors.testing import Rig
from robot.contracts import (
    BATTERY_STATE,
    BATTERY_STATUS,
    DOCK,
    GLOBAL_COSTMAP,
    GOAL_POSE,
    GOAL_REPORT,
    INITIAL_POSE,
    LOCAL_COSTMAP,
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_GOAL,
    NAVIGATE_TO_POSE,
    POSE,
    SIT,
    STAND,
    UNDOCK,
    WALK,
)
from robot.geometry.messages import from_pose, seconds
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import (
    NavigateThroughPoses,
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from robot.interfaces.nav2_msgs.msg import WaypointStatus
from robot.interfaces.robactor_msgs.action import Dock, Dock_Feedback, Dock_Goal, Dock_Result
from robot.interfaces.robactor_msgs.msg import BatteryStatus
from robot.nodes.navigation import Navigation
from robot.nodes.patrol import Patrol
from robot.planning.errors import ErrorCode
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.scenes.scene import Box
from tests.robot.stage import at, drop, floor, navigate, speed, standing_robot, to_place, true_pose, warnings


async def failure_of(rig: Rig, x: float, y: float, frame: str = "map", tree: str = "") -> tuple[int, str]:
    """The code and the words with which a goal is aborted."""
    goal = await rig.send_goal(NAVIGATE_TO_POSE, to_place(x, y, 0.0, frame, tree))
    with pytest.raises(GoalAborted) as failed:
        await goal
    assert isinstance(failed.value.result, NavigateToPose_Result)
    return failed.value.result.error_code, failed.value.result.error_msg


async def test_a_client_of_nav2_walks_the_robot_and_hears_how_far_it_is(rig: Rig) -> None:
    body = await standing_robot(rig)
    begun = rig.now
    goal = await rig.send_goal(NAVIGATE_TO_POSE, to_place(3.0, 0.5, 0.5))
    told = [feedback async for feedback in goal]
    result = await goal
    assert (result.error_code, result.error_msg) == (ErrorCode.NONE, "")
    here = true_pose(body)
    assert (here.x, here.y, here.yaw) == pytest.approx((3.0, 0.5, 0.5), abs=0.1)
    first, last = told[0], told[-1]
    assert first.current_pose.header.frame_id == "map"
    assert first.distance_remaining == pytest.approx(math.hypot(3.0, 0.5), abs=0.2)
    assert last.distance_remaining < 0.1
    assert seconds(last.navigation_time) == pytest.approx(rig.now - begun, abs=0.2)
    assert 2.0 < seconds(first.estimated_time_remaining) < 10.0
    assert {feedback.number_of_recoveries for feedback in told} == {0}
    assert max(abs(feedback.position_tracking_error) for feedback in told) < 0.2


async def test_what_cannot_be_reached_is_refused_with_its_code_and_a_running_goal_goes_on(rig: Rig) -> None:
    body = await standing_robot(rig)
    running = await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5))
    await rig.advance(2.0)
    code, words = await failure_of(rig, 2.5, 2.1)
    assert code == ErrorCode.GOAL_OCCUPIED
    assert words.startswith("GoalBlocked: the goal (2.50, 2.10)")
    assert (await failure_of(rig, 1000.0, 0.0))[0] == ErrorCode.GOAL_OCCUPIED
    assert (await failure_of(rig, math.nan, 0.0))[0] == ErrorCode.GOAL_OCCUPIED
    assert await failure_of(rig, 1.0, 0.0, frame="moon") == (
        ErrorCode.TF_ERROR,
        "unknown frame 'moon': give the goal in frame 'map'",
    )
    assert (await failure_of(rig, 1.0, 0.0, tree="dance.xml"))[0] == ErrorCode.FAILED_TO_LOAD_BEHAVIOR_TREE
    await rig.advance(0.5)
    assert speed(body) > 0.5
    assert not running.done


async def test_without_the_energy_for_the_way_and_back_a_goal_is_refused_with_the_code_for_it(rig: Rig) -> None:
    await rig.start(Child(Navigation, args=(Grid.from_scene(floor()), Pose2(0.0, 0.0))))
    rig.publish(POSE, at(5.0, 0.0))
    rig.publish(BATTERY_STATUS, BatteryStatus(level="low", percent=12.0, energy=5.0))
    await rig.quiet()
    code, words = await failure_of(rig, 8.0, 0.0)
    assert code == ErrorCode.LOW_BATTERY
    assert "only the way to the dock is open" in words


async def test_a_goal_that_comes_before_the_first_pose_waits_a_moment_for_it(rig: Rig) -> None:
    """A client that has waited for the server may be faster than the localizer."""
    await rig.start(Child(Navigation, args=(Grid.from_scene(floor()),)))
    begun = rig.now
    assert (await failure_of(rig, 1.0, 0.0))[0] == ErrorCode.TF_ERROR
    assert rig.now - begun == pytest.approx(1.0)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, to_place(1000.0, 0.0))
    await rig.advance(0.5)
    assert not goal.done
    rig.publish(POSE, at(0.0, 0.0))
    with pytest.raises(GoalAborted) as failed:
        await goal
    assert ErrorCode.of(failed.value.result) == ErrorCode.GOAL_OCCUPIED


async def test_a_goal_that_is_canceled_stops_the_robot(rig: Rig) -> None:
    body = await standing_robot(rig)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5))
    await rig.advance(3.0)
    assert await goal.cancel()
    with pytest.raises(GoalCanceled):
        await goal
    await rig.advance(1.0)
    assert speed(body) < 0.02


async def test_a_newer_goal_takes_over_without_a_stop_and_the_older_one_is_aborted_with_the_code_for_it(
    rig: Rig,
) -> None:
    body = await standing_robot(rig)
    first = await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5))
    await rig.advance(3.0)
    second = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(8.0, 0.0))
    with pytest.raises(GoalAborted, match="preempted by a newer goal") as preempted:
        await first
    assert ErrorCode.of(preempted.value.result) == ErrorCode.PREEMPTED
    assert speed(body) > 0.5
    assert (await second).success


async def test_a_way_that_is_closed_on_the_way_is_aborted_with_nav2s_code_for_patience(rig: Rig) -> None:
    body = await standing_robot(rig)
    drop(body, Box(2.5, 0.0, 0.4, 0.4))
    goal = await rig.send_goal(NAVIGATE_TO_POSE, to_place(4.0, 0.0, behavior_tree="straight"))
    await rig.until(lambda: goal.done, within=60.0, step=0.1)
    with pytest.raises(GoalAborted, match="PathBlocked") as failed:
        await goal
    assert ErrorCode.of(failed.value.result) == ErrorCode.PATIENCE_EXCEEDED
    assert true_pose(body).x < 2.3


async def test_poses_are_walked_through_in_turn_and_each_is_told_of(rig: Rig) -> None:
    body = await standing_robot(rig)
    poses = (at(1.0, 0.0), at(2.0, 0.5), at(1.0, 0.5, math.pi))
    goal = await rig.send_goal(NAVIGATE_THROUGH_POSES, NavigateThroughPoses.Goal(poses=Goals(goals=poses)))
    seen = [(feedback.number_of_poses_remaining, from_pose(feedback.current_pose.pose)) async for feedback in goal]
    result = await goal
    assert list(dict.fromkeys(left for left, _ in seen)) == [3, 2, 1]
    second = next(here for left, here in seen if left == 2)
    assert (second.x, second.y) == pytest.approx((1.0, 0.0), abs=0.1), "the second begins where the first ended"
    assert [one.waypoint_status for one in result.waypoint_statuses] == [WaypointStatus.COMPLETED] * 3
    assert (true_pose(body).x, true_pose(body).y) == pytest.approx((1.0, 0.5), abs=0.1)


async def test_poses_of_which_one_cannot_be_reached_are_refused_before_anything_moves(rig: Rig) -> None:
    body = await standing_robot(rig)
    before = true_pose(body)
    poses = (at(1.0, 0.0), at(2.5, 2.1))
    goal = await rig.send_goal(NAVIGATE_THROUGH_POSES, NavigateThroughPoses.Goal(poses=Goals(goals=poses)))
    with pytest.raises(GoalAborted) as failed:
        await goal
    assert ErrorCode.of(failed.value.result) == ErrorCode.GOAL_OCCUPIED
    assert true_pose(body) == before
    with pytest.raises(GoalRejected, match="0 poses: give 1 to 1000"):
        await rig.send_goal(NAVIGATE_THROUGH_POSES, NavigateThroughPoses.Goal())


async def test_a_goal_pose_of_rviz_walks_the_robot_there_and_a_newer_one_takes_over(rig: Rig) -> None:
    body = await standing_robot(rig)
    rig.publish(GOAL_POSE, at(8.8, 0.5))
    await rig.advance(3.0)
    assert speed(body) > 0.5
    rig.publish(GOAL_POSE, at(1.0, 0.0))
    await rig.until(lambda: abs(true_pose(body).x - 1.0) < 0.1 and speed(body) < 0.02, within=30.0, step=0.1)
    rig.publish(GOAL_POSE, at(2.5, 2.1))
    await rig.advance(0.5)
    assert warnings(rig, "navigation") == ["the goal of /goal_pose was not reached"] * 2
    assert speed(body) < 0.02


async def test_an_initial_pose_of_rviz_puts_the_robot_there_on_the_map(rig: Rig) -> None:
    body = await standing_robot(rig)
    here, poses = true_pose(body), rig.probe(POSE)
    message = PoseWithCovarianceStamped(
        header=Header(frame_id="map"), pose=PoseWithCovariance(pose=at(here.x + 3.0, here.y, here.yaw).pose)
    )
    rig.publish(INITIAL_POSE, message)
    await rig.until(lambda: poses.last is not None and poses.last.pose.position.x > here.x + 2.0, within=0.2)


def cost(costmap: OccupancyGrid, x: float, y: float) -> int:
    """Of the cell at a place, in the costmap's own frame."""
    info = costmap.info
    column = int((x - info.origin.position.x) / info.resolution)
    row = int((y - info.origin.position.y) / info.resolution)
    return int(costmap.data.reshape(info.height, info.width)[row, column])


async def test_the_costmaps_show_walls_and_what_the_map_does_not_know_and_are_made_only_while_somebody_looks(
    rig: Rig,
) -> None:
    body = await standing_robot(rig)
    start, made = body.scene.start, rig.node(Navigation)
    drop(body, Box(start.x + 1.5, start.y, 0.4, 0.4))
    await rig.advance(2.0)
    assert (made.global_costmap.subscription_count, made.local_costmap.subscription_count) == (0, 0)
    whole, near = rig.probe(GLOBAL_COSTMAP), rig.probe(LOCAL_COSTMAP)
    await rig.advance(2.05)
    assert (len(whole), len(near)) == (2, 4), "nothing was kept from before"
    assert (whole[-1].header.frame_id, near[-1].header.frame_id) == ("map", "odom")
    assert (near[-1].info.width * near[-1].info.resolution) == pytest.approx(4.0)
    assert cost(whole[-1], start.x, start.y) == 0
    assert cost(whole[-1], start.x + 1.32, start.y) >= 99, "the face of the box"
    assert cost(near[-1], 1.32, 0.0) >= 99, "the same, where odometry has it"
    assert cost(near[-1], 0.0, 0.0) < 99
    assert cost(whole[-1], 2.5, 2.1) == 100, "a shelf that is on the map"
    assert 0 < cost(whole[-1], start.x + 0.9, start.y) < 99


async def test_a_vanished_client_leaves_no_goal_behind(rig: Rig) -> None:
    body = await standing_robot(rig)
    async with rig.me.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5)) as going:
        await rig.advance(2.0)
    assert (await going.ended()).status is GoalStatus.CANCELED
    await rig.advance(1.5)
    assert speed(body) < 0.02


class Tired(Node):
    """The rest of a robot, whose navigation refuses each goal with `code` and `words`; it counts who asks for the dock."""

    code, words, asked_to_dock = ErrorCode.LOW_BATTERY, "", 0

    @NAVIGATE_TO_POSE.serve()
    async def navigate(self, goal: NavigateToPose_Goal) -> Steps[NavigateToPose_Feedback, NavigateToPose_Result]:
        yield Aborted(NavigateToPose.Result(error_code=self.code), self.words)

    @DOCK.serve()
    async def dock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        self.asked_to_dock += 1
        yield Done(Dock.Result())

    @UNDOCK.serve()
    async def undock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        yield Done(Dock.Result())

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger_Response(success=True)

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger_Response(success=True)

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger_Response(success=True)


@pytest.mark.parametrize(
    ("code", "words", "docks"),
    [
        (ErrorCode.LOW_BATTERY, "not enough for the way back", True),
        (ErrorCode.PATIENCE_EXCEEDED, "battery crates stand in the way", False),
    ],
)
async def test_a_patrol_goes_to_the_dock_for_the_code_of_a_refusal_and_not_for_its_words(
    rig: Rig, code: ErrorCode, words: str, docks: bool
) -> None:
    world = floor(half=5.0)
    patrol = Child(Patrol, args=([("there", Pose2(1.0, 0.0))], world.dock, Grid.from_scene(world)))
    await rig.start(Tired, patrol)
    rest = rig.node(Tired)
    rest.code, rest.words = code, words
    reports = rig.probe(GOAL_REPORT)
    rig.publish(BATTERY_STATE, BatteryState(percentage=0.9))
    rig.publish(POSE, at(0.0, 0.0))
    await rig.until(lambda: len(reports) >= 2, within=10.0)
    assert (reports[0].outcome, reports[0].error_code, reports[0].reason) == ("aborted", code, words)
    assert (rest.asked_to_dock > 0) is docks


def test_the_tracking_error_is_positive_left_of_the_path_and_turned_to_its_right() -> None:
    path = Path(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]))
    assert path.tracking_error(1.0, 0.3, -0.2) == pytest.approx((0.3, 0.2))
    assert path.tracking_error(2.4, 1.0, math.pi / 2) == pytest.approx((-0.4, 0.0))
    assert path.tracking_error(1.9, 2.5, math.pi / 2)[0] > 0.0
