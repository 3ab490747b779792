"""The calibration service of the robot: it estimates the gyro's bias, the driver takes it off, and a robot that moves is refused."""

from __future__ import annotations

import asyncio
from typing import TypeVar

import numpy as np
import pytest

from actors import Child, Supervisor
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot.contracts import CALIBRATE_SENSOR, CMD_VEL, IMU, IMU_CALIBRATION, STAND, WALK
from robot.interfaces.tutorials.your_package.srv import SensorCalibration
from robot.nodes.calibration import Calibration
from robot.nodes.proprioception import Proprioception
from robot.run.tree_nodes import only
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody
from tests.robot.stage import done, robot_around, twist

T = TypeVar("T")


async def calibrate(rig: Rig, name: str, *, reset_only: bool = False) -> SensorCalibration.Response:
    request = SensorCalibration.Request(sensor_name=name, reset_only=reset_only)
    return await done(rig, rig.call(CALIBRATE_SENSOR, request, timeout=6.0), 7.0)


async def standing(rig: Rig, seed: int = 1) -> KinematicBody:
    """A robot that stands still in an empty hall."""
    body = KinematicBody(get_world("empty"), seed=1)
    await rig.start(only(robot_around(body), ["motors", "proprioception", "gait", "calibration"]))
    await done(rig, rig.call(STAND, Trigger.Request()))
    await rig.advance(3.0)
    return body


def gyro_mean(messages: list[Imu]) -> np.ndarray:
    return np.mean([(m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z) for m in messages], axis=0)


async def test_the_gyros_bias_is_estimated_taken_off_and_forgotten_again(rig: Rig) -> None:
    body = await standing(rig)
    told = rig.probe(IMU_CALIBRATION)
    answer = await calibrate(rig, "imu")
    assert (answer.success, answer.message) == (True, "Successfully calibrated imu")
    assert told.last is not None
    bias = told.last.gyro_bias
    true = body._imu_noise.gyro.bias
    assert (bias.x, bias.y, bias.z) == pytest.approx(true.tolist(), abs=4e-4)
    assert told.last.samples >= 590
    assert (told.last.roll, told.last.pitch) == pytest.approx((0.0, 0.0), abs=0.02)

    probe = rig.probe(IMU)
    await rig.advance(2.0)
    assert np.abs(gyro_mean(list(probe))).max() < 6e-4 < np.abs(true).max()

    again = await calibrate(rig, "imu")  # on corrected samples: it must not forget what is taken off already
    assert again.success
    assert (told.last.gyro_bias.x, told.last.gyro_bias.y) == pytest.approx(true.tolist()[:2], abs=5e-4)

    reset = await calibrate(rig, "imu", reset_only=True)
    assert (reset.success, reset.message) == (True, "Successfully reset calibration of imu")
    assert told.last.gyro_bias == Vector3()
    await rig.advance(0.1)
    probe.clear()
    await rig.advance(2.0)
    assert gyro_mean(list(probe)) == pytest.approx(body._imu_noise.gyro.bias, abs=6e-4)


async def test_a_robot_that_walks_is_refused_with_the_reason(rig: Rig) -> None:
    await standing(rig)
    told = rig.probe(IMU_CALIBRATION)
    await rig.quiet()
    assert told.last is not None and told.last.samples == 0
    await done(rig, rig.call(WALK, Trigger.Request()))
    asked = asyncio.ensure_future(rig.call(CALIBRATE_SENSOR, SensorCalibration.Request(sensor_name="imu"), timeout=6.0))
    while not asked.done():
        rig.publish(CMD_VEL, twist(0.3))
        await rig.advance(0.1)
    answer = await asked
    assert not answer.success
    assert answer.message.startswith("Failed to calibrate imu: the robot is walking: let it sit or stand still for 3 s")
    assert len(told) == 1


async def test_a_robot_that_is_shoved_meanwhile_is_refused_with_the_speed(rig: Rig) -> None:
    body = await standing(rig)
    asked = asyncio.ensure_future(rig.call(CALIBRATE_SENSOR, SensorCalibration.Request(sensor_name="imu"), timeout=6.0))
    await rig.advance(1.0)
    body.push((20.0, 0.0, 0.0))
    await rig.until(asked.done)
    answer = await asked
    assert not answer.success
    assert answer.message.startswith("Failed to calibrate imu: the robot moves at 0.")
    assert answer.message.endswith("more than 0.02: let it stand still for 3 s")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("", "Name the sensor to calibrate: there are imu, lidar, camera, encoders"),
        ("imo", "There is no sensor called 'imo'; did you mean imu? there are imu, lidar, camera, encoders"),
        (
            "camera_1",
            "There is no sensor called 'camera_1'; did you mean camera? there are imu, lidar, camera, encoders",
        ),
        ("lidar", "Failed to calibrate lidar: its ranges have no error that standing still would show"),
    ],
)
async def test_what_cannot_be_calibrated_is_refused_with_the_names_there_are(rig: Rig, name: str, text: str) -> None:
    await rig.start(Supervisor("robot", children=[Child(Calibration)]))
    answer = await calibrate(rig, name)
    assert not answer.success
    assert answer.message.startswith(text)


async def test_an_exception_is_told_to_the_caller_and_the_service_lives(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    await rig.start(Supervisor("robot", children=[Child(Calibration)]))

    async def boom(self: Calibration) -> None:
        raise RuntimeError("boom")

    monkeypatch.setattr(Calibration, "_calibrate_imu", boom)
    answer = await calibrate(rig, "imu")
    assert (answer.success, answer.message) == (False, "Error during calibration: boom")
    assert (await calibrate(rig, "imu", reset_only=True)).success


async def test_every_request_is_logged_with_its_name_and_flag(rig: Rig) -> None:
    system = await rig.start(Supervisor("robot", children=[Child(Calibration)]))
    await calibrate(rig, "imu", reset_only=True)
    await calibrate(rig, "imu")
    lines = [record.event for record in system.records if record.node == "/calibration"]
    assert lines[:4] == [
        "Request to calibrate sensor: imu, reset only: True",
        "Resetting calibration for imu",
        "Request to calibrate sensor: imu, reset only: False",
        "Calibrating imu",
    ]


async def test_silent_sensors_are_told(rig: Rig) -> None:
    await rig.start(Supervisor("robot", children=[Child(Calibration)]))
    answer = await calibrate(rig, "imu")
    assert answer.message.startswith("Failed to calibrate imu: ")
    assert "0 samples came in 3 s" in answer.message


async def test_a_restarted_calibration_and_a_restarted_driver_keep_the_bias(rig: Rig) -> None:
    body = await standing(rig)
    await calibrate(rig, "imu")
    true = body._imu_noise.gyro.bias
    for node in (Calibration, Proprioception):
        rig.crash(node)
        await rig.until(lambda node=node: rig.incarnation(node) == 2)
        await rig.advance(0.1)
    probe = rig.probe(IMU)
    await rig.advance(2.0)
    assert np.abs(gyro_mean(list(probe))).max() < 6e-4 < np.abs(true).max()


async def test_two_requests_at_once_are_served_one_after_the_other(rig: Rig) -> None:
    await standing(rig)
    request = SensorCalibration.Request(sensor_name="imu")
    calls = [asyncio.ensure_future(rig.call(CALIBRATE_SENSOR, request, timeout=9.0)) for _ in range(2)]
    before = rig.now
    await rig.until(lambda: all(call.done() for call in calls), within=10.0)
    assert [(await call).success for call in calls] == [True, True]
    assert rig.now - before == pytest.approx(6.0, abs=0.2)
