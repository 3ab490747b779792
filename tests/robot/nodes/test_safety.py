"""The safety monitor: what stops the robot, what that means for the others, and how it ends (F-06, F-07, F-08, X-18, Z-08)."""

from __future__ import annotations

from math import cos, hypot, nan, sin

import pytest

from actors import (
    ActorError,
    Child,
    GoalAborted,
    Node,
    Supervisor,
    every,
    publishes,
    rest_for_one,
)
from actors.interfaces.geometry_msgs.msg import (
    Pose,
    PoseWithCovariance,
    Quaternion,
    TwistWithCovariance,
)
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Response, Trigger, Trigger_Request, Trigger_Response
from actors.testing import Rig, scenario
from actors.testing.faults import Crash, Delay, Freeze, Lose, NotANumber, Reorder, SlowStart
from robot import Robot
from robot.contracts import (
    BATTERY_STATUS,
    CMD_VEL,
    DRIVE_STATUS,
    EMERGENCY_STOP,
    ENABLE,
    GAIT_STATUS,
    NAVIGATE_TO_POSE,
    ODOMETRY,
    SAFETY_STATE,
    SENSOR_DATA,
    SIT,
    STAND,
    TELEOP_CMD,
    VOICE,
    WALK,
)
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus
from robot.interfaces.tutorials.my_robot_interfaces.msg import SensorData
from robot.nodes.safety import SafetyMonitor
from robot.nodes.twist_mux import RobotController
from robot.planning.errors import ErrorCode
from robot.run.tree_nodes import only
from robot.scenes.worlds import get_world
from tests.robot.stage import ahead, robot, robot_around, twist, warnings, without


def odometry(roll: float = 0.0, speed: float = 0.0) -> Odometry:
    pose = Pose(orientation=Quaternion(x=sin(roll / 2), w=cos(roll / 2)))
    return Odometry(pose=PoseWithCovariance(pose=pose), twist=TwistWithCovariance(twist=twist(speed)))


async def press(rig: Rig, *, stop: bool) -> SetBool_Response:
    return await rig.call(EMERGENCY_STOP, SetBool.Request(data=stop))


def reasons(rig: Rig) -> tuple[str, ...]:
    last = rig.probe(SAFETY_STATE).last  # latched
    assert last is not None
    assert last.stopped is (last.reasons != ())
    return last.reasons


# -- what stops it --------------------------------------------------------------------------------------------------------------


async def test_the_stop_button_stops_until_it_is_released(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    assert reasons(rig) == ()
    reply = await press(rig, stop=True)
    assert (reply.success, reply.message) == (True, "Emergency stop: emergency stop requested")
    assert reasons(rig) == ("emergency stop requested",)
    await rig.advance(10.0)
    assert reasons(rig) == ("emergency stop requested",)
    reply = await press(rig, stop=False)
    assert (reply.success, reply.message) == (True, "Emergency stop cleared")
    assert reasons(rig) == ()
    reply = await press(rig, stop=False)
    assert (reply.success, reply.message) == (True, "There is no emergency stop to clear")


async def test_the_emergency_stop_field_of_the_tutorials_message_stops_too(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    rig.publish(SENSOR_DATA, SensorData(emergency_stop=True))
    await rig.quiet()
    assert reasons(rig) == ("emergency stop in /sensor_data",)
    reply = await press(rig, stop=False)
    assert (reply.success, reply.message) == (False, "Emergency stop not cleared: emergency stop in /sensor_data")
    rig.publish(SENSOR_DATA, SensorData(emergency_stop=False))
    await rig.quiet()
    assert reasons(rig) == ("emergency stop in /sensor_data",)  # latched: somebody must say that it is over
    ways = [event for event in warnings(rig, "safety_monitor") if "/emergency_stop with data false" in event]
    assert len(ways) == 1, "the stop says how to go on as soon as its cause has gone"
    assert (await press(rig, stop=False)).success
    assert reasons(rig) == ()


@pytest.mark.parametrize(("command", "why"), [(nan, "not a number"), (9.0, "beyond the limits"), (-0.6, "beyond")])
async def test_a_command_that_the_legs_should_never_get_stops_the_robot(rig: Rig, command: float, why: str) -> None:
    await rig.start(SafetyMonitor)
    rig.publish(CMD_VEL, twist(command))
    await rig.quiet()
    assert why in reasons(rig)[0]
    rig.publish(CMD_VEL, twist())
    await rig.quiet()
    assert (await press(rig, stop=False)).success


async def test_a_robot_that_tilts_is_stopped_and_sat_down(rig: Rig) -> None:
    await rig.start(SafetyMonitor)

    async def lean(roll: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            rig.publish(ODOMETRY, odometry(roll=roll))
            await rig.advance(0.02)

    await lean(0.6, 1.0)
    assert reasons(rig) == ()  # a steep slope
    await lean(1.0, 0.16)
    await lean(0.0, 0.1)
    assert reasons(rig) == ()  # an estimate that settles
    await lean(1.0, 0.3)
    assert reasons(rig) == ("the body tilts by 57 degrees",)
    assert [record.fields["why"] for record in rig.logs if record.event == "sitting down"] == ["the robot tilts"]
    assert not (await press(rig, stop=False)).success


async def test_silence_of_gait_and_odometry_stops_and_their_return_lets_it_be_cleared(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    await rig.advance(5.0)
    assert reasons(rig) == ()  # who has never been heard is not missed: nodes may come late
    rig.publish(GAIT_STATUS, GaitStatus(sensors_ok=True))
    rig.publish(ODOMETRY, odometry())
    await rig.advance(0.4)
    assert reasons(rig) == ()
    await rig.advance(0.2)
    assert set(reasons(rig)) == {"/gait_status is silent", "/odom is silent"}
    rig.publish(ODOMETRY, odometry())
    await rig.advance(0.1)
    reply = await press(rig, stop=False)
    assert (reply.success, reply.message) == (False, "Emergency stop not cleared: /gait_status is silent")


async def test_a_short_silence_of_the_sensors_is_the_gaits_business_a_long_one_stops(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    for _ in range(10):
        rig.publish(GAIT_STATUS, GaitStatus(sensors_ok=False))
        await rig.advance(0.1)
    assert reasons(rig) == ()
    for _ in range(15):
        rig.publish(GAIT_STATUS, GaitStatus(sensors_ok=False))
        await rig.advance(0.1)
    assert reasons(rig) == ("the gait has no sensors",)
    rig.publish(GAIT_STATUS, GaitStatus(sensors_ok=True))
    await rig.advance(0.1)
    assert (await press(rig, stop=False)).success


async def test_a_critical_battery_stops_as_long_as_it_is_critical(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    rig.publish(BATTERY_STATUS, BatteryStatus(level="critical", percent=9.4))
    await rig.quiet()
    assert reasons(rig) == ("battery critical (9 %)",)
    assert not (await press(rig, stop=False)).success
    rig.publish(BATTERY_STATUS, BatteryStatus(level="low", percent=13.1))
    await rig.quiet()
    assert reasons(rig) == ()  # a robot on its dock needs nobody to go on


async def test_a_stopped_robot_that_moves_all_the_same_is_sat_down(rig: Rig) -> None:
    await rig.start(SafetyMonitor)
    await press(rig, stop=True)
    for _ in range(20):
        rig.publish(ODOMETRY, odometry(speed=0.5))
        await rig.advance(0.1)
    assert [record.fields["why"] for record in rig.logs if record.event == "sitting down"] == [
        "the stopped robot moves"
    ]


async def test_a_stop_outlives_a_crash_of_the_monitor(rig: Rig) -> None:
    await rig.start(SafetyMonitor, RobotController)
    await press(rig, stop=True)
    rig.crash(SafetyMonitor)
    await rig.settled()
    assert rig.incarnation(SafetyMonitor) == 2
    assert reasons(rig) == ("emergency stop requested",)
    await rig.call(ENABLE, SetBool.Request(data=True))
    cmd = rig.probe(CMD_VEL)
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.advance(0.5)
    assert {str(message) for message in cmd} == {str(twist())}
    assert (await press(rig, stop=False)).success
    rig.publish(TELEOP_CMD, twist(0.5))
    await rig.quiet()
    assert cmd.last == twist(0.5)


async def test_a_stopped_robot_is_asked_to_stand_for_as_long_as_it_steps(rig: Rig) -> None:
    asked: list[str] = []

    class Legs(Node):
        @STAND.serve()
        async def stand(self, request: Trigger_Request) -> Trigger_Response:
            asked.append("stand")
            return Trigger.Response(success=True)

        @SIT.serve()
        async def sit(self, request: Trigger_Request) -> Trigger_Response:
            asked.append("sit")
            return Trigger.Response(success=True)

    await rig.start(SafetyMonitor, Legs)
    rig.publish(GAIT_STATUS, GaitStatus(goal="walk", sensors_ok=True))
    await rig.advance(0.1)
    await press(rig, stop=True)
    assert asked == []
    for goal in ("walk", "stand", "walk"):
        rig.publish(GAIT_STATUS, GaitStatus(goal=goal, sensors_ok=True))
        await rig.advance(0.1)
    assert asked == ["stand", "stand"]
    rig.publish(BATTERY_STATUS, BatteryStatus(level="critical", percent=9.0))
    await rig.advance(0.1)
    assert asked == ["stand", "stand", "sit"]


# -- the whole robot ------------------------------------------------------------------------------------------------------------


async def test_an_emergency_stop_ends_the_goal_and_no_other_begins_until_it_is_cleared(rig: Rig) -> None:
    await rig.start(robot())
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 3.0)))
    await rig.advance(2.0)
    cmd = rig.probe(CMD_VEL)
    asked = rig.now
    assert (await press(rig, stop=True)).success
    await rig.advance(0.005)
    assert cmd.last == twist()
    assert cmd.times[-1] - asked <= 0.005  # within one control period of 200 Hz
    with pytest.raises(GoalAborted, match="safety stop: emergency stop requested"):
        await goal
    with pytest.raises(GoalAborted, match="safety stop: emergency stop requested") as refused:
        await (await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 3.0))))
    assert ErrorCode.of(refused.value.result) == ErrorCode.SAFETY_STOP
    await rig.advance(1.0)
    status = rig.probe(GAIT_STATUS).last
    assert status is not None
    assert status.goal == "stand"  # a stopped robot does not step in place
    speed = rig.probe(ODOMETRY)
    await rig.advance(0.1)
    assert speed.last is not None
    assert abs(speed.last.twist.twist.linear.x) < 0.05
    assert (await press(rig, stop=False)).success
    await rig.quiet()
    goal = await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 2.0)))
    cmd.clear()
    await rig.until(lambda: cmd.last is not None and cmd.last.linear.x > 0.3, within=10.0, step=0.1)
    await goal.cancel()
    await rig.advance(0.2)


async def test_in_physics_a_walking_robot_brakes_and_stays_on_its_feet(rig: Rig) -> None:
    pytest.importorskip("mujoco")
    from robot.sim.physics import PhysicsBody

    body = PhysicsBody(get_world("empty"), seed=1, delay=0.004)
    legs = ["motors", "proprioception", "gait", "safety_monitor", "robot_controller"]
    await rig.start(only(robot_around(body), legs))
    await rig.advance(0.5)
    await rig.call(WALK, Trigger.Request())
    await rig.advance(3.0)
    for _ in range(5):
        rig.publish(TELEOP_CMD, twist(0.7))
        await rig.advance(0.3)
    assert hypot(*body.truth().velocity[:2]) > 0.5
    await press(rig, stop=True)
    await rig.advance(1.0)
    assert hypot(*body.truth().velocity[:2]) < 0.1
    assert not body.truth().fallen
    status = rig.probe(GAIT_STATUS).last
    assert status is not None
    assert status.goal == "stand"
    await rig.system.stop("seen")
    body.close()


async def test_cancel_is_a_zero_on_cmd_vel_within_a_tenth_of_a_second(rig: Rig) -> None:
    await rig.start(robot())
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    goal = await rig.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=ahead("empty", 3.0)))
    await rig.advance(1.5)
    cmd = rig.probe(CMD_VEL)
    asked = rig.now
    await goal.cancel()
    await rig.advance(0.3)
    first_zero = next(at for at, message in zip(cmd.times, cmd, strict=True) if message == twist())
    assert first_zero - asked <= 0.1


async def test_voice_walks_the_robot_and_disable_stops_it(rig: Rig) -> None:
    await rig.start(robot())
    assert (await rig.call(ENABLE, SetBool.Request(data=True))).success
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    await rig.call(WALK, Trigger.Request())
    await rig.advance(1.0)
    odom, cmd = rig.probe(ODOMETRY), rig.probe(CMD_VEL)

    def speed() -> float:
        assert odom.last is not None
        return odom.last.twist.twist.linear.x

    for _ in range(5):
        rig.publish(VOICE, String(data="frente"))
        await rig.advance(0.3)
    assert speed() > 0.6
    rig.publish(VOICE, String(data="parar"))
    await rig.advance(1.5)
    assert abs(speed()) < 0.05
    status = rig.probe(GAIT_STATUS).last
    assert status is not None
    assert status.mode == "walk"  # stepping in place
    rig.publish(VOICE, String(data="frente"))
    await rig.advance(0.1)
    cmd.clear()
    asked = rig.now
    await rig.call(ENABLE, SetBool.Request(data=False))
    await rig.quiet()
    assert (cmd.last, cmd.times[-1] - asked) == (twist(), 0.0)
    drive = rig.probe(DRIVE_STATUS).last
    assert drive is not None
    assert (drive.enabled, drive.reason) == (False, "disabled")


# -- whatever goes wrong --------------------------------------------------------------------------------------------------------


class Stubborn(Node):
    """An operator who never lets go of the stick."""

    stick = publishes(TELEOP_CMD)

    @every(hz=20)
    def push(self) -> None:
        self.stick(twist(0.5))


@scenario(
    seeds=150,
    faults=[
        Lose(SAFETY_STATE, at_most=3),
        Delay(SAFETY_STATE),
        Reorder(SAFETY_STATE),
        Freeze(SAFETY_STATE),
        NotANumber(TELEOP_CMD),
        Crash(SafetyMonitor),
        Crash(RobotController),
        SlowStart(SafetyMonitor),
    ],
)
async def test_whatever_is_lost_late_or_killed_a_stop_stops_the_robot_and_keeps_it_stopped(rig: Rig) -> None:
    nodes = (Child(RobotController, parameters={"enabled": True, "safety_timeout": 0.3}), Child(Stubborn))
    tree = Supervisor("robot", strategy=rest_for_one, children=[Child(SafetyMonitor), *nodes])
    await rig.start(tree)
    cmd = rig.probe(CMD_VEL)
    await rig.advance(1.0)
    while True:
        try:
            if (await press(rig, stop=True)).success:
                break
        except ActorError:
            await rig.advance(0.01)
    pressed = rig.now
    await rig.advance(3.0)
    late = [at - pressed for at, message in zip(cmd.times, cmd, strict=True) if at > pressed and message != twist()]
    assert all(seconds <= 0.4 for seconds in late), late
    assert cmd.last == twist()


async def test_the_patrol_waits_for_the_end_of_a_stop_and_goes_on(rig: Rig) -> None:
    patrol = [Pose2(4.0, 0.0), Pose2(0.0, 0.0)]
    robot = Robot("empty", body="kinematic", mission=patrol, seed=1)
    await rig.start(without(robot.tree, "camera", "detector"))
    await rig.advance(4.0)
    await press(rig, stop=True)
    await rig.advance(4.0)
    waiting = [record for record in rig.logs if record.event == "waiting until the robot may move"]
    assert [record.fields["why"] for record in waiting] == ["emergency stop requested"]
    cmd = rig.probe(CMD_VEL)
    await press(rig, stop=False)
    await rig.until(lambda: cmd.last is not None and cmd.last.linear.x > 0.3, within=5.0, step=0.1)
