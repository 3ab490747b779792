"""What people see while the robot runs: one calm line that renews itself on a terminal, plain log lines elsewhere."""

from __future__ import annotations

import shutil
import sys
from math import degrees
from typing import IO

from actors import Node, background, every
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.logs import LogRecord, LogSink
from robot.contracts import BATTERY_STATE, DRIVE_STATUS, GAIT_STATUS, POSE
from robot.interfaces.robactor_msgs.msg import DriveStatus, GaitStatus
from robot.navigation.geometry import from_pose
from robot.world.scene import Pose2

__all__ = ["Status", "StatusLine"]

LINES_EVERY = 5.0
"""Seconds between the status lines of a log."""
STATUS = "robot"
"""The event of such a line."""


class StatusLine:
    """The last line of a terminal, kept below the log lines that scroll by. Does nothing where there is no terminal."""

    def __init__(self, stream: IO[str] | None = None) -> None:
        self._stream = stream or sys.stderr
        self.live = self._stream.isatty()
        self._text = ""

    def show(self, text: str) -> None:
        """Renew the line."""
        self._text = text
        width = shutil.get_terminal_size().columns - 1  # a line that wraps could not be renewed
        self._stream.write(f"\r\x1b[2K{text[:width]}")
        self._stream.flush()

    def above(self, sink: LogSink) -> LogSink:
        """A sink that writes its lines above the status line, but for those that say the same as it does."""

        def write(record: LogRecord) -> None:
            if self.live and record.event == STATUS:
                return
            if self._text:
                self._stream.write("\r\x1b[2K")
            sink(record)
            if self._text:
                self.show(self._text)

        return write

    def end(self) -> None:
        """Leave the line standing and go on below it."""
        if self._text:
            self._text = ""
            self._stream.write("\n")
            self._stream.flush()


class Status(Node):
    """Reports battery and pose as the robot goes: x and y in metres, the heading in degrees for people. Not a part of the robot."""

    def __init__(self, line: StatusLine, backend: str) -> None:
        self._line = line
        self._backend = backend
        self._pose: Pose2 | None = None
        self._battery: BatteryState | None = None
        self._mode = "-"
        self._driver = ""

    @POSE.on(qos=1)
    def pose(self, message: PoseStamped) -> None:
        self._pose = from_pose(message.pose)

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._battery = message

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @DRIVE_STATUS.on()
    def drive(self, message: DriveStatus) -> None:
        self._driver = f"{message.source} drives" if message.source else message.reason

    @every(hz=2)
    def renew(self) -> None:
        if self._line.live:
            self._line.show(self._text())

    @background
    async def log_lines(self) -> None:
        while True:  # whatever is shown of it: a run is the same on a terminal and in a pipe
            await self.clock.sleep(LINES_EVERY)
            pose, battery = self._pose, self._battery
            if pose is not None and battery is not None:
                self.log.info(
                    STATUS, x=round(pose.x, 2), y=round(pose.y, 2), heading_deg=round(degrees(pose.yaw)), gait=self._mode,
                    battery=f"{100 * battery.percentage:.1f} %", volts=round(battery.voltage, 2), backend=self._backend,
                )  # fmt: skip

    def _text(self) -> str:
        parts = [f"{self.clock.now():7.1f} s", f"{self._backend} body"]
        if self._pose is not None:
            parts.append(f"x {self._pose.x:6.2f}  y {self._pose.y:6.2f}  heading {degrees(self._pose.yaw):4.0f} deg")
        parts.append(f"gait {self._mode}")
        if self._driver:
            parts.append(self._driver)
        if self._battery is not None:
            charging = (
                ", charging" if self._battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING else ""
            )
            parts.append(f"battery {100 * self._battery.percentage:.1f} % {self._battery.voltage:.2f} V{charging}")
        return "  |  ".join(parts)
