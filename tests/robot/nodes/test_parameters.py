"""What a user may tune while the robot runs: each parameter changes what the robot does, from the next step on."""

from __future__ import annotations

import math

import pytest

from actors import Aborted, Child, Done, GoalAborted, Node, Reject, Steps
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import BatteryState, Imu, JointState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import SetBool, Trigger_Request, Trigger_Response
from actors.testing import Probe, Rig
from robot import Robot
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATE,
    CMD_VEL,
    DOCK,
    EMERGENCY_STOP,
    GAIT_STATUS,
    GOAL_REPORT,
    IMU,
    JOINT_STATES,
    NAVIGATE_TO_POSE,
    ODOMETRY,
    POSE,
    SIT,
    STAND,
    UNDOCK,
    WALK,
)
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2, compose
from robot.hardware.body import JOINT_NAMES
from robot.interfaces.nav2_msgs.action import (
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from robot.interfaces.robactor_msgs.action import Dock, Dock_Feedback, Dock_Goal, Dock_Result
from robot.interfaces.robactor_msgs.msg import GaitStatus, GoalReport
from robot.nodes.docking import Docking
from robot.nodes.gait import Gait
from robot.nodes.navigation import Navigation
from robot.nodes.patrol import Patrol
from robot.nodes.safety import SafetyMonitor
from robot.planning.grid import Grid
from robot.run.tree_nodes import only
from robot.scenes.dock import BEFORE
from robot.scenes.scene import Box
from tests.robot.stage import (
    apart,
    drop,
    floor,
    said,
    speed,
    standing_robot,
    take_station_away,
    to_place,
    true_pose,
    twist,
)


def tune(rig: Rig, node: type[Node], **values: float) -> None:
    for name, value in values.items():
        result = rig.node(node).set_parameter(name, value)
        assert result.successful, result.reason


class Obliging(Node):
    """The rest of a robot: it does at once what it is asked to, but `refuses` to reach goals if told so."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.refuses = False

    @NAVIGATE_TO_POSE.serve()
    async def navigate(self, goal: NavigateToPose_Goal) -> Steps[NavigateToPose_Feedback, NavigateToPose_Result]:
        yield Aborted(NavigateToPose.Result(), "refused") if self.refuses else Done(NavigateToPose.Result())

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        self.asked.append("stand")
        return Trigger_Response(success=True)

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        self.asked.append("sit")
        return Trigger_Response(success=True)

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        self.asked.append("walk")
        return Trigger_Response(success=True)


class NoDock(Node):
    """A dock that cannot be reached, and can be left at any time."""

    def __init__(self) -> None:
        self.tries = 0
        self.tries_at_leaving: list[int] = []

    @DOCK.accepts
    def dockable(self, goal: Dock_Goal) -> None:
        self.tries += 1
        raise Reject("there is no dock")

    @DOCK.serve()
    async def dock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        yield Done(Dock.Result())

    @UNDOCK.serve()
    async def undock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        self.tries_at_leaving.append(self.tries)
        yield Done(Dock.Result(success=True))


# -- docking ----------------------------------------------------------------------------------------------------------------------


DOCK_POSE = Pose2(2.0, 1.0, 0.5)


async def docking(rig: Rig, *, visible: bool = False) -> None:
    await rig.start(Obliging, Child(Docking, args=(DOCK_POSE, visible)))


def place(rig: Rig, off: Pose2, mode: str = "walk") -> None:
    """The robot is here in the frame of the dock."""
    rig.publish(POSE, pose_stamped(compose(DOCK_POSE, off), Time()))
    rig.publish(GAIT_STATUS, GaitStatus(mode=mode, goal=mode))


async def test_approach_speed_bounds_the_way_onto_the_dock_from_the_next_command_on(rig: Rig) -> None:
    await docking(rig)
    place(rig, BEFORE)
    await rig.quiet()
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(DOCK, Dock.Goal())
    await rig.until(lambda: len(commands) > 0)
    assert commands[-1].linear.x == pytest.approx(0.25)
    tune(rig, Docking, approach_speed=0.1)
    await rig.advance(0.06)
    assert commands[-1].linear.x == pytest.approx(0.1)


async def test_approach_turn_bounds_the_turn_onto_the_dock(rig: Rig) -> None:
    await docking(rig)
    place(rig, Pose2(0.0, 0.0, -1.0))
    await rig.quiet()
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(DOCK, Dock.Goal())
    await rig.until(lambda: len(commands) > 0)
    assert commands[-1].angular.z == pytest.approx(0.4)
    tune(rig, Docking, approach_turn=0.15)
    await rig.advance(0.06)
    assert commands[-1].angular.z == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("off", "name", "value"),
    [(Pose2(-0.1, 0.0, 0.0), "position_tolerance", 0.15), (Pose2(0.0, 0.0, 0.1), "yaw_tolerance", 0.15)],
)
async def test_the_tolerances_of_docking_say_what_counts_as_on_the_dock(
    rig: Rig, off: Pose2, name: str, value: float
) -> None:
    await docking(rig)
    place(rig, off)
    await rig.quiet()
    going = await rig.send_goal(DOCK, Dock.Goal())
    await rig.advance(3.0)
    stages = [feedback.stage for feedback in [await anext(going) for _ in range(going.feedback_count)]]
    assert stages[-1] == "approaching"
    tune(rig, Docking, **{name: value})
    await rig.advance(0.1)
    assert (await anext(going)).stage == "sitting"


async def test_find_timeout_says_how_long_the_station_is_looked_for(rig: Rig) -> None:
    await docking(rig, visible=True)
    tune(rig, Docking, find_timeout=1.5)
    place(rig, BEFORE)
    await rig.quiet()
    begun = rig.now
    with pytest.raises(GoalAborted, match=r"dock not found: no station seen within 1\.5 s"):
        await (await rig.send_goal(DOCK, Dock.Goal()))
    assert rig.now - begun == pytest.approx(1.5, abs=0.1)


async def test_lost_timeout_says_how_long_the_station_may_be_out_of_sight(rig: Rig) -> None:
    body = await standing_robot(rig)
    tune(rig, Docking, lost_timeout=0.4)
    going = await rig.send_goal(DOCK, Dock.Goal())
    async for feedback in going:
        if feedback.stage == "approaching" and feedback.distance_remaining < 0.6:
            break
    take_station_away(body)
    begun = rig.now
    with pytest.raises(GoalAborted, match=r"dock lost: the station has been out of sight for 0\.4 s"):
        await going
    assert rig.now - begun < 0.65


async def test_charge_timeout_and_tries_say_how_long_and_how_often_the_charger_is_waited_for(rig: Rig) -> None:
    await docking(rig)
    tune(rig, Docking, charge_timeout=1.0, tries=2)
    place(rig, Pose2(0.0, 0.0))
    await rig.quiet()
    going = await rig.send_goal(DOCK, Dock.Goal())
    modes = {"sitting": "sit", "rising": "stand"}
    stages: list[tuple[str, float]] = []
    async for feedback in going:
        stages.append((feedback.stage, rig.now))
        place(rig, Pose2(0.0, 0.0), mode=modes.get(feedback.stage, "walk"))
    with pytest.raises(GoalAborted, match="the charger's contacts did not close in 2 approaches"):
        await going
    sat, rose = ([at for stage, at in stages if stage == name] for name in ("sitting", "rising"))
    assert (len(sat), len(rose)) == (2, 2)
    assert rose[0] - sat[0] == pytest.approx(1.0, abs=0.15)


# -- navigation -------------------------------------------------------------------------------------------------------------------


async def test_max_speed_bounds_a_walk_that_is_under_way(rig: Rig) -> None:
    body = await standing_robot(rig)
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5))
    await rig.advance(4.0)
    assert max(message.linear.x for message in commands) > 0.6
    tune(rig, Navigation, max_speed=0.3)
    await rig.advance(0.1)
    commands.clear()
    await rig.advance(2.0)
    assert max(message.linear.x for message in commands) == pytest.approx(0.3, abs=1e-6)
    assert speed(body) < 0.35


async def test_max_turn_bounds_the_turning_rate(rig: Rig) -> None:
    await standing_robot(rig)
    tune(rig, Navigation, max_turn=0.3)
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(NAVIGATE_TO_POSE, to_place(0.0, 0.0, math.pi - 0.2))
    await rig.advance(5.0)
    assert max(abs(message.angular.z) for message in commands) == pytest.approx(0.3, abs=1e-6)


async def test_acceleration_bounds_how_fast_commands_grow(rig: Rig) -> None:
    await standing_robot(rig)
    tune(rig, Navigation, acceleration=0.2)
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.8, 0.5))
    await rig.until(lambda: any(message.linear.x > 0.0 for message in commands))
    await rig.advance(1.5)
    assert 0.2 < max(message.linear.x for message in commands) < 0.35


async def test_position_tolerance_says_where_a_walk_has_arrived(rig: Rig) -> None:
    body = await standing_robot(rig)
    tune(rig, Navigation, position_tolerance=0.4)
    await (await rig.send_goal(NAVIGATE_TO_POSE, to_place(2.0, 0.0)))
    assert 0.15 < apart(true_pose(body), Pose2(2.0, 0.0)) <= 0.45


async def test_yaw_tolerance_says_whether_the_heading_matters(rig: Rig) -> None:
    body = await standing_robot(rig)
    tune(rig, Navigation, yaw_tolerance=1.5)
    await (await rig.send_goal(NAVIGATE_TO_POSE, to_place(2.0, 0.0, 2.5)))
    assert 0.5 < 2.5 - true_pose(body).yaw < 1.6


async def test_patience_says_how_long_what_stands_in_the_way_is_waited_for(rig: Rig) -> None:
    body = await standing_robot(rig, "corridor")
    tune(rig, Navigation, patience=1.0)
    await rig.send_goal(NAVIGATE_TO_POSE, to_place(8.0, 0.0))
    await rig.advance(3.0)
    drop(body, Box(6.0, 0.0, 0.4, 1.6))
    await rig.until(lambda: speed(body) < 0.02)
    commands, halted = rig.probe(AUTONOMY_CMD), rig.now
    await rig.until(lambda: any(message.linear.x < -0.05 for message in commands), within=8.0)
    assert rig.now - halted < 6.0, "eight seconds are the default"


async def test_a_value_beyond_its_range_is_refused_and_changes_nothing(rig: Rig) -> None:
    await standing_robot(rig)
    result = rig.node(Navigation).set_parameter("max_speed", 2.5)
    assert not result.successful
    assert "max_speed" in result.reason
    assert rig.node(Navigation).max_speed == 0.7


# -- gait -------------------------------------------------------------------------------------------------------------------------


async def test_command_timeout_says_how_long_a_velocity_is_kept_up(rig: Rig) -> None:
    robot = Robot(floor(), body="kinematic", seed=1)
    await rig.start(only(robot.tree, ["motors", "proprioception", "gait"]))
    tune(rig, Gait, command_timeout=2.0)
    await rig.advance(0.5)
    await rig.call(WALK, Trigger_Request())
    await rig.advance(3.0)
    rig.publish(CMD_VEL, twist(0.5))
    await rig.advance(1.8)
    assert speed(robot.body) == pytest.approx(0.5, abs=0.05)
    await rig.advance(1.5)
    assert speed(robot.body) < 0.05


async def test_sensor_timeout_says_when_silent_encoders_are_lost(rig: Rig) -> None:
    await rig.start(Gait)
    tune(rig, Gait, sensor_timeout=0.5)
    zeros = [0.0] * 12
    rig.publish(IMU, Imu())
    rig.publish(JOINT_STATES, JointState(name=JOINT_NAMES, position=zeros, velocity=zeros, effort=zeros))
    await rig.advance(0.45)
    assert said(rig, "gait") == []
    await rig.advance(0.2)
    assert said(rig, "gait")[0] == "joint encoders are silent: no motor targets"


# -- safety -----------------------------------------------------------------------------------------------------------------------


def moving(speed: float) -> Odometry:
    return Odometry(pose=PoseWithCovariance(), twist=TwistWithCovariance(twist=twist(speed)))


async def test_braking_time_says_when_a_stopped_robot_that_moves_is_sat_down(rig: Rig) -> None:
    await rig.start(SafetyMonitor, Obliging)
    tune(rig, SafetyMonitor, braking_time=0.3)
    await rig.call(EMERGENCY_STOP, SetBool.Request(data=True))
    await rig.advance(0.25)
    rig.publish(ODOMETRY, moving(0.5))
    await rig.quiet()
    assert rig.node(Obliging).asked == []
    await rig.advance(0.1)
    rig.publish(ODOMETRY, moving(0.5))
    await rig.quiet()
    assert rig.node(Obliging).asked == ["sit"]


async def test_still_speed_says_what_counts_as_moving_under_a_stop(rig: Rig) -> None:
    await rig.start(SafetyMonitor, Obliging)
    tune(rig, SafetyMonitor, still_speed=0.4)
    await rig.call(EMERGENCY_STOP, SetBool.Request(data=True))
    await rig.advance(2.0)
    rig.publish(ODOMETRY, moving(0.3))
    await rig.quiet()
    assert rig.node(Obliging).asked == []
    rig.publish(ODOMETRY, moving(0.5))
    await rig.quiet()
    assert rig.node(Obliging).asked == ["sit"]


# -- patrol -----------------------------------------------------------------------------------------------------------------------


async def patrolling(rig: Rig) -> Probe[GoalReport]:
    world = floor(half=5.0)
    patrol = Child(
        Patrol, args=([("there", Pose2(1.0, 0.0))], world.dock, Grid.from_scene(world)), parameters={"laps": 1}
    )
    await rig.start(Obliging, NoDock, patrol)
    rig.node(Obliging).refuses = True
    return rig.probe(GOAL_REPORT)


def wake(rig: Rig, percent: float) -> None:
    rig.publish(BATTERY_STATE, BatteryState(header=Header(), percentage=percent / 100.0))
    rig.publish(POSE, pose_stamped(Pose2(0.0, 0.0), Time()))


async def test_retry_pause_is_the_time_between_two_tries_of_a_goal(rig: Rig) -> None:
    reports = await patrolling(rig)
    tune(rig, Patrol, retry_pause=4.0)
    wake(rig, 90.0)
    await rig.advance(9.0)
    assert len(reports) == 3
    assert [b - a for a, b in zip(reports.times, reports.times[1:], strict=False)] == pytest.approx([4.0, 4.0], abs=0.1)


async def test_docking_tries_says_how_often_it_tries_to_dock(rig: Rig) -> None:
    await patrolling(rig)
    tune(rig, Patrol, docking_tries=5)
    wake(rig, 20.0)
    await rig.until(lambda: rig.node(NoDock).tries_at_leaving != [])
    assert rig.node(NoDock).tries_at_leaving == [5]
