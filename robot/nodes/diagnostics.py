"""The robot's health in the form that ROS 2's diagnostic tools read."""

from __future__ import annotations

from typing import Final

from actors import Node, every, publishes
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import BATTERY_STATUS, DIAGNOSTICS, GAIT_STATUS, MOTOR_POWER, ODOMETRY, POSE, SAFETY_STATE, SCAN
from robot.hardware.real_time import SLOW
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, MotorPower, SafetyState
from robot.model.charge import ChargeLevel

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK,
    DiagnosticStatus.WARN,
    DiagnosticStatus.ERROR,
    DiagnosticStatus.STALE,
)
LEVELS: Final[dict[str, int]] = {ChargeLevel.GOOD: OK, ChargeLevel.LOW: WARN, ChargeLevel.CRITICAL: ERROR}
EXPECTED: Final = {"/odom": 50.0, "/pose": 50.0, "/lidar/scan": 10.0}
"""Messages a second that come when all is well."""
ENOUGH: Final = 0.8
"""A topic with less than this share of them is warned of."""
PATIENCE: Final = 0.1
"""Seconds for which what is only counted or noted may wait: its reports are a second apart."""


class Diagnostics(Node):
    """Publishes diagnostics at 1 Hz: battery, motors, gait, safety, localization and the rate of each topic that these rest on.

    Takes battery_status, motor_power, gait_status, safety_state, odom, pose and lidar/scan. What has never been heard is stale; what was
    heard, but not since the last report, is an error.
    """

    out = publishes(DIAGNOSTICS)

    async def on_start(self) -> None:
        self._heard = dict.fromkeys(EXPECTED, 0)
        self._ever = set[str]()
        self._told = {
            name: _status(name, STALE, "not heard of yet")
            for name in ("battery", "motors", "real time", "gait", "safety")
        }

    @BATTERY_STATUS.on()
    def battery(self, message: BatteryStatus) -> None:
        text = f"{message.level}, {message.percent:.0f} %" + (", charging" if message.charging else "")
        self._tell(
            "battery",
            LEVELS.get(message.level, ERROR),
            text,
            percent=f"{message.percent:.1f}",
            runtime_s=f"{message.runtime:.0f}",
            mean_load_w=f"{message.mean_load:.0f}",
        )

    @MOTOR_POWER.on(patience=PATIENCE)
    def motors(self, message: MotorPower) -> None:
        level, text = OK, f"{message.mean:.0f} W"
        if not message.supplied:
            level, text = ERROR, "no current: the battery is empty"
        elif message.torque_left < 1.0:
            level, text = WARN, f"hot: {message.torque_left:.0%} of the torque is left"
        warmth = {"hottest_c": f"{max(message.temperature):.1f}"} if len(message.temperature) else {}
        self._tell("motors", level, text, power_w=f"{message.mean:.1f}", **warmth)
        factor = message.real_time_factor
        slow = factor < SLOW
        self._tell(
            "real time",
            WARN if slow else OK,
            f"{factor:.2f} of real time" if slow else "in time",
            factor=f"{factor:.2f}",
        )

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        text = message.mode if message.sensors_ok else "IMU or encoders are silent"
        self._tell("gait", OK if message.sensors_ok else ERROR, text, mode=message.mode, gait=message.gait)

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        self._tell("safety", ERROR if message.stopped else OK, "; ".join(message.reasons) or "no reason to stop")

    @ODOMETRY.on(qos=20, patience=PATIENCE)
    def odometry(self, message: Odometry) -> None:
        self._heard["/odom"] += 1

    @POSE.on(qos=20, patience=PATIENCE)
    def pose(self, message: PoseStamped) -> None:
        self._heard["/pose"] += 1

    @SCAN.on(patience=PATIENCE)
    def scan(self, message: LaserScan) -> None:
        self._heard["/lidar/scan"] += 1

    @every(hz=1)
    def report(self) -> None:
        rates = [self._rate(topic, count) for topic, count in self._heard.items()]
        self._heard = dict.fromkeys(EXPECTED, 0)
        statuses = (*self._told.values(), *rates)
        self.out(DiagnosticArray(header=Header(stamp=self.clock.stamp()), status=statuses))

    def _rate(self, topic: str, heard: int) -> DiagnosticStatus:
        """The judgement of a topic by what was heard in the last second."""
        if heard:
            self._ever.add(topic)
        elif topic not in self._ever:
            return _status(f"rate of {topic}", STALE, "not heard of yet")
        level = OK if heard >= ENOUGH * EXPECTED[topic] else WARN if heard else ERROR
        values = {"rate_hz": str(heard), "expected_hz": f"{EXPECTED[topic]:g}"}
        return _status(f"rate of {topic}", level, f"{heard} Hz" if heard else "silent", **values)

    def _tell(self, name: str, level: int, message: str, **values: str) -> None:
        self._told[name] = _status(name, level, message, **values)


def _status(name: str, level: int, message: str, **values: str) -> DiagnosticStatus:
    pairs = tuple(KeyValue(key=key, value=value) for key, value in values.items())
    return DiagnosticStatus(level=level, name=f"robot: {name}", message=message, hardware_id="robot", values=pairs)
