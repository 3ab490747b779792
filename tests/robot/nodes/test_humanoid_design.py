"""The humanoid design exercise (X-04, Y-11): four requirements, each met by the pattern that fits it, in one running system.

Pattern and reason of each are in docs/reference/robot.md.
"""

from __future__ import annotations

from itertools import pairwise

import pytest

from actors import Child, Parameter, Service
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.sensor_msgs.msg import JointState
from actors.parameters.messages import to_parameter
from actors.testing import Rig
from robot.contracts import (
    ARM_JOINT_STATES,
    CALIBRATE_ARM,
    GET_BATTERY_STATUS,
    GET_ROBOT_POSE,
    HUMANOID_NAVIGATE,
    JOINT_STATES,
    MOVE_ARM,
    PLAN_PATH,
)
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm
from robot.interfaces.tutorials.your_package.action import HumanoidNav
from robot.interfaces.tutorials.your_package.srv import SensorCalibration
from robot.sim.kinematic import KinematicBody
from robot.tutorials.motor_controller import MotorController
from tests.robot.stage import KITCHEN, at, awake

Request = SensorCalibration.Request


async def test_joint_angles_arm_calibration_navigation_and_battery_in_one_running_system(rig: Rig) -> None:
    body = await awake(rig, KinematicBody(KITCHEN, seed=1, arm=True))
    legs, arm = rig.probe(JOINT_STATES), rig.probe(ARM_JOINT_STATES)

    # Arm calibration: a question with an answer, so a service.
    reply = await rig.call(CALIBRATE_ARM, Request(sensor_name="arm"))
    assert (reply.success, reply.message) == (True, "Successfully calibrated arm")
    assert (await rig.call(CALIBRATE_ARM, Request(sensor_name="arm", reset_only=True))).success
    reply = await rig.call(CALIBRATE_ARM, Request(sensor_name="leg"))
    assert (reply.success, reply.message) == (False, "There is no sensor called 'leg' here; ask for arm or gripper")

    # Navigation: takes long, tells its progress and can be canceled, so an action; the other three go on meanwhile.
    goal = await rig.send_goal(
        HUMANOID_NAVIGATE, HumanoidNav.Goal(target_position=[1.0, -0.5, 0.0], avoid_obstacles=True)
    )
    told, charges = [], []
    async for feedback in goal:
        told.append(feedback.distance_remaining)
        battery = await rig.call(GET_BATTERY_STATUS, GetBatteryStatus.Request(robot_id="robot_01"))
        charges.append(battery.voltage)
    assert (await goal).success
    assert told[-1] < told[0]
    assert len(charges) == len(told) >= 1
    assert all(10.0 < voltage <= 12.6 for voltage in charges)
    assert body.truth().position[:2] == pytest.approx([1.0, -0.5], abs=0.1)

    # Joint angles: flow all the time, to any number of readers, so topics.
    assert {type(message) for message in (*legs, *arm)} == {JointState}
    for probe, hz in ((legs, 200.0), (arm, 50.0)):
        assert all(b - a == pytest.approx(1.0 / hz, abs=1e-6) for a, b in pairwise(probe.times))


async def test_a_path_the_pose_and_the_control_gains_are_each_asked_for_and_answered(rig: Rig) -> None:
    await awake(rig, KinematicBody(KITCHEN, seed=1, arm=True))
    await rig.system.join(Child(MotorController))
    path = await rig.call(PLAN_PATH, PlanPath.Request(start=at(0.0, 0.0), goal=at(3.0, 0.5)))
    assert path.success
    assert len(path.path.poses) >= 2
    pose = await rig.call(GET_ROBOT_POSE, GetRobotPose.Request())
    assert pose.success
    assert (pose.pose.pose.position.x, pose.pose.pose.position.y) == pytest.approx((0.0, 0.0), abs=0.05)
    for node, name, value in (("motor_controller", "pid_gains", (1.5, 0.2, 0.02)), ("navigation", "max_speed", 0.5)):
        service = Service(SetParameters, f"/{node}/set_parameters")
        reply = await rig.call(service, SetParameters.Request(parameters=[to_parameter(Parameter(name, value))]))
        assert [result.successful for result in reply.results] == [True]


async def test_an_arm_that_moves_is_not_calibrated(rig: Rig) -> None:
    await awake(rig, KinematicBody(KITCHEN, seed=1, arm=True))
    await rig.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=[0.0, -1.0, 1.0, 0.0]))
    await rig.advance(0.5)
    reply = await rig.call(CALIBRATE_ARM, Request(sensor_name="arm"))
    assert (reply.success, reply.message) == (False, "Failed to calibrate arm: the arm is moving")
