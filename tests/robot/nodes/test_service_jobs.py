"""What one asks the running robot by service: each job has its own, and each answers."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from actors import Service
from actors.interfaces.rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from actors.interfaces.rcl_interfaces.srv import GetParameters, SetParameters
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.testing import Rig
from robot.contracts import (
    CALIBRATE_SENSOR,
    CAPTURE_PHOTO,
    ENABLE,
    GAIT_STATUS,
    GET_ROBOT_POSE,
    GET_STATUS,
    PLAN_PATH,
    RESTORE_CONFIG,
    SAVE_CONFIG,
    SIT,
    STAND,
)
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose
from robot.interfaces.tutorials.your_package.srv import SensorCalibration
from tests.robot.stage import done, robot

T = TypeVar("T")

SET = Service(SetParameters, "/localizer/set_parameters")
GET = Service(GetParameters, "/localizer/get_parameters")


def number(name: str, value: float) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value))


async def gain(rig: Rig) -> float:
    reply = await rig.call(GET, GetParameters.Request(names=["gain"]))
    return reply.values[0].double_value


async def test_every_job_of_the_running_robot_has_a_service_that_answers(rig: Rig, tmp_path: Path) -> None:
    await rig.start(robot())
    await rig.advance(0.5)
    file = Service(SetParameters, "/robot_status/set_parameters")
    text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(tmp_path / "robot.yaml"))
    await rig.call(file, SetParameters.Request(parameters=[Parameter(name="config_file", value=text)]))
    assert (await rig.call(SET, SetParameters.Request(parameters=[number("gain", 0.25)]))).results[0].successful
    assert (await done(rig, rig.call(SAVE_CONFIG, Trigger.Request()))).success
    await rig.call(SET, SetParameters.Request(parameters=[number("gain", 0.9)]))
    assert (await done(rig, rig.call(RESTORE_CONFIG, Trigger.Request()))).success
    assert await gain(rig) == 0.25

    request = SensorCalibration.Request(sensor_name="imu")
    calibrated = await done(rig, rig.call(CALIBRATE_SENSOR, request, timeout=6.0))
    assert (calibrated.success, calibrated.message) == (True, "Successfully calibrated imu")
    assert (await rig.call(GET_STATUS, Trigger.Request())).message.startswith("Robot Status:")
    assert (await rig.call(ENABLE, SetBool.Request(data=False))).success
    assert (await rig.call(ENABLE, SetBool.Request(data=True))).success


async def test_a_path_the_pose_and_the_gains_are_asked_for_and_answered(rig: Rig) -> None:
    await rig.start(robot())
    await rig.advance(0.5)
    stamp = rig.system.clock.stamp()
    start, goal = pose_stamped(Pose2(0.0, 0.0), stamp), pose_stamped(Pose2(3.0, 1.0), stamp)
    planned = await rig.call(PLAN_PATH, PlanPath.Request(start=start, goal=goal))
    assert planned.success
    assert planned.path.poses[-1].pose.position == goal.pose.position
    here = await rig.call(GET_ROBOT_POSE, GetRobotPose.Request())
    assert (here.success, here.pose.header.frame_id) == (True, "map")
    answer = await rig.call(SET, SetParameters.Request(parameters=[number("gain", 0.3), number("gain", 7.0)]))
    assert [result.successful for result in answer.results] == [True, False]
    assert await gain(rig) == 0.3


async def test_the_mode_is_changed_the_sensor_reset_and_a_photo_taken(rig: Rig, tmp_path: Path) -> None:
    await rig.start(robot())
    await rig.advance(0.5)
    modes = rig.probe(GAIT_STATUS)
    for service, mode in ((STAND, "stand"), (SIT, "sit")):
        assert (await rig.call(service, Trigger.Request())).success
        await rig.until(lambda mode=mode: modes.last is not None and modes.last.mode == mode)  # type: ignore[misc]
    reset = await rig.call(CALIBRATE_SENSOR, SensorCalibration.Request(sensor_name="imu", reset_only=True))
    assert (reset.success, reset.message) == (True, "Successfully reset calibration of imu")
    place = Service(SetParameters, "/camera/set_parameters")
    text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(tmp_path))
    await rig.call(place, SetParameters.Request(parameters=[Parameter(name="photo_directory", value=text)]))
    photo = await done(rig, rig.call(CAPTURE_PHOTO, Trigger.Request()))
    assert photo.success
    assert photo.message.startswith(str(tmp_path))
