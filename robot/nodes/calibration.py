"""The calibration service: what a sensor's errors are, estimated while the robot stands still, and taken off by the sensor's driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import degrees
from typing import Final, TypeVar

from actors import Node, publishes
from actors.interfaces import Message
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import Imu
from actors.suggest import did_you_mean
from actors.typing import Stream
from robot.contracts import CALIBRATE_SENSOR, GAIT_STATUS, IMU_CALIBRATION, IMU_RAW, ODOMETRY
from robot.estimation.rest import AT_REST, NotAtRest, Rest, rest_of
from robot.interfaces.robactor_msgs.msg import GaitStatus, ImuCalibration
from robot.interfaces.tutorials.your_package.srv import (
    SensorCalibration,
    SensorCalibration_Request,
    SensorCalibration_Response,
)
from robot.model.modes import Mode

M = TypeVar("M", bound=Message)

NOT_CALIBRATED: Final = {
    "lidar": "its ranges have no error that standing still would show; the localizer fits them to the map",
    "camera": "its lens is known exactly, and no test card is in sight",
    "encoders": "their zeros are set where they are built in: the legs would have to be driven to their stops",
}
"""The sensors that have nothing to calibrate here, and why."""
SENSORS: Final = ("imu", *NOT_CALIBRATED)
DOING: Final[Mapping[str, str]] = {
    Mode.WALK: "walking",
    Mode.STOPPING: "coming to a halt",
    Mode.LOWERING: "sitting down",
}
"""Modes of the gait, as one says them."""


class Calibration(Node):
    """Serves calibrate_sensor for `imu`: 3 s of standing still, then imu/calibration tells the gyro's bias, and the driver takes it off imu/data.

    Refuses, with the reason, while the robot moves, turns or shakes. `reset_only` forgets the bias. Answers after some 3 s; one at a time.
    """

    told = publishes(IMU_CALIBRATION)

    def __init__(self) -> None:
        self._now = ImuCalibration()
        self._mode = ""

    def resume(self, state: ImuCalibration) -> None:
        self._now = state

    async def on_start(self) -> None:
        self.told(self._now)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @CALIBRATE_SENSOR.serve(concurrent=1)
    async def calibrate(self, request: SensorCalibration_Request) -> SensorCalibration_Response:
        name, reset_only = request.sensor_name, request.reset_only
        self.log.info(f"Request to calibrate sensor: {name}, reset only: {reset_only}")
        if name not in SENSORS:
            return _answer(False, _unknown(name))
        try:
            if reset_only:
                self.log.info(f"Resetting calibration for {name}")
                self._reset(name)
                return _answer(True, f"Successfully reset calibration of {name}")
            if name in NOT_CALIBRATED:
                return _answer(False, f"Failed to calibrate {name}: {NOT_CALIBRATED[name]}")
            self.log.info(f"Calibrating {name}")
            await self._calibrate_imu()
        except NotAtRest as error:
            self.log.warning("calibration refused", sensor=name, reason=str(error))
            return _answer(False, f"Failed to calibrate {name}: {error}")
        except Exception as error:  # the tutorials' contract: the caller is told, the service lives
            self.log.error("calibration failed", sensor=name, error=repr(error))
            return _answer(False, f"Error during calibration: {error}")
        return _answer(True, f"Successfully calibrated {name}")

    def _reset(self, name: str) -> None:
        if name == "imu":
            self._tell(ImuCalibration(stamp=self.clock.stamp()))

    async def _calibrate_imu(self) -> None:
        self._check_gait()
        rest = await self._rest()
        self._check_gait()
        bias = _vector3(rest.gyro.tolist())
        self._tell(
            ImuCalibration(
                stamp=self.clock.stamp(), gyro_bias=bias, gyro_sd=_vector3(rest.gyro_sd.tolist()), gravity=_vector3(rest.accel.tolist()),
                roll=rest.roll, pitch=rest.pitch, samples=rest.samples,
            )
        )  # fmt: skip
        self.log.info(
            "IMU calibrated", bias=tuple(round(one, 6) for one in (bias.x, bias.y, bias.z)), unit="rad/s", samples=rest.samples,
            roll_deg=round(degrees(rest.roll), 3), pitch_deg=round(degrees(rest.pitch), 3),
        )  # fmt: skip

    def _check_gait(self) -> None:
        """A robot that rises, lowers itself or walks is not at rest, however slowly it does it. Raises `NotAtRest`."""
        if self._mode not in ("", Mode.SIT, Mode.STAND):
            raise NotAtRest(
                f"the robot is {DOING.get(self._mode, self._mode)}: let it sit or stand still for {AT_REST:g} s"
            )

    def _tell(self, calibration: ImuCalibration) -> None:
        self._now = calibration
        self.checkpoint(calibration)
        self.told(calibration)

    async def _rest(self) -> Rest:
        """Listen for that long. Raises `NotAtRest`."""
        gyro: list[tuple[float, float, float]] = []
        accel: list[tuple[float, float, float]] = []
        speeds: list[float] = []
        turns: list[float] = []

        def imu(message: Imu) -> None:
            w, a = message.angular_velocity, message.linear_acceleration
            gyro.append((w.x, w.y, w.z))
            accel.append((a.x, a.y, a.z))

        def odometry(message: Odometry) -> None:
            twist = message.twist.twist
            speeds.append((twist.linear.x**2 + twist.linear.y**2 + twist.linear.z**2) ** 0.5)
            turns.append(twist.angular.z)

        listening = [
            self.create_task(_each(self.subscribe(IMU_RAW, qos=IMU_RAW.qos.replace(depth=50)), imu), name="imu"),
            self.create_task(_each(self.subscribe(ODOMETRY), odometry), name="odom"),
        ]
        try:
            await self.clock.sleep(AT_REST)
        finally:
            for task in listening:
                task.cancel()
        return rest_of(gyro, accel, speeds, turns)


async def _each(messages: Stream[M], take: Callable[[M], None]) -> None:
    async with messages:
        async for message in messages:
            take(message)


def _answer(success: bool, message: str) -> SensorCalibration_Response:
    return SensorCalibration.Response(success=success, message=message)


def _unknown(name: str) -> str:
    if not name:
        return f"Name the sensor to calibrate: there are {', '.join(SENSORS)}"
    near = did_you_mean(name, SENSORS, quoted=False)
    return f"There is no sensor called {name!r}{near or ';'} there are {', '.join(SENSORS)}"


def _vector3(values: list[float]) -> Vector3:
    x, y, z = values
    return Vector3(x=x, y=y, z=z)
