"""What people see while the robot runs: one calm line that renews itself on a terminal, plain log lines elsewhere."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from math import degrees
from typing import IO, NamedTuple

import numpy as np

from actors import ExitReason, Node, background, every
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import Path as PathMessage
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.logs import LogRecord, LogSink
from robot.contracts import BATTERY_STATE, DRIVE_STATUS, GAIT_STATUS, PATH, POSE
from robot.geometry.messages import from_pose
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import DriveStatus, GaitStatus
from robot.planning.path import Path
from robot.run.judge import Score
from robot.sim.simulation import Truth

LINES_EVERY = 5.0
"""Seconds between the status lines of a log."""
STATUS = "robot"
"""The event of such a line."""
SEPARATOR = " | "
CLEAR = "\r\x1b[2K\x1b[J"
"""To the start of the line; erase it, and what is below: a terminal that became narrower has broken the line into several."""
SITTING = 0.25
"""A body that is lower than this over the floor sits, m."""


class Part(NamedTuple):
    """A part of the status line. Where there is no room for all, those of the lowest `rank` are left out."""

    rank: int
    text: str


class StatusLine:
    """The last line of a terminal, kept below the log lines that scroll by. Does nothing where there is no terminal.

    The cursor waits at the start of the line. When the terminal becomes narrower and breaks the line, the cursor stays before all of it,
    and the next renewal erases the whole.
    """

    def __init__(self, stream: IO[str] | None = None) -> None:
        self._stream = stream or sys.stderr
        self.live = self._stream.isatty()
        self._parts: tuple[Part, ...] = ()

    def show(self, parts: Sequence[Part]) -> None:
        """Renew the line, with as many of the parts as there is room for."""
        self._parts = tuple(parts)
        width = shutil.get_terminal_size().columns - 1  # a line that wraps could not be renewed
        self._stream.write(f"{CLEAR}{fitting(self._parts, width)}\r")
        self._stream.flush()

    def above(self, sink: LogSink) -> LogSink:
        """A sink that writes its lines above the status line, but for those that say the same as it does."""

        def write(record: LogRecord) -> None:
            if self.live and record.event == STATUS:
                return
            if self._parts:
                self._stream.write(CLEAR)
            sink(record)
            if self._parts:
                self.show(self._parts)

        return write

    def clear(self) -> None:
        """Take the line away."""
        if self._parts:
            self._parts = ()
            self._stream.write(CLEAR)
            self._stream.flush()

    def end(self, parts: Sequence[Part] = ()) -> None:
        """Leave the line standing, with these parts if there are any, and go on below it."""
        if self._parts:
            self.show(parts or self._parts)
            self._parts = ()
            self._stream.write("\n")
            self._stream.flush()


def fitting(parts: Sequence[Part], width: int) -> str:
    """The parts in their order, without those of the lowest rank that do not fit into `width` columns."""
    chosen = list(parts)
    while True:
        text = SEPARATOR.join(part.text for part in chosen)
        if len(text) <= width or len(chosen) <= 1:
            return text[:width]
        chosen.remove(min(chosen, key=lambda part: part.rank))


def final_parts(truth: Truth, score: Score, seconds: float) -> list[Part]:
    """The last status line of a run: what has become of the robot, as the judge sees it."""
    x, y, z = (float(value) for value in truth.position)
    posture = "has fallen" if truth.fallen else "sits" if z < SITTING else "stands"
    parts = [
        Part(9, f"{seconds:7.1f} s"),
        Part(8, f"the robot {posture}"),
        Part(5, _place(Pose2(x, y, truth.yaw))),
    ]
    if score.charge is not None:
        parts.append(Part(6, f"battery {100 * score.charge:.1f} %" + (", charging" if score.charging else "")))
    return parts


class Status(Node):
    """Reports battery and pose as the robot goes: x and y in metres, the heading in degrees for people. Not a part of the robot."""

    def __init__(self, line: StatusLine, backend: str) -> None:
        self._line = line
        self._backend = backend
        self._pose: Pose2 | None = None
        self._battery: BatteryState | None = None
        self._path: Path | None = None
        self._mode = "-"
        self._driver = self._standing = ""

    async def on_stop(self, reason: ExitReason) -> None:
        if self._line.live:
            self._line.show([Part(9, f"{self.clock.now():7.1f} s"), Part(8, "stopping")])

    @POSE.on(qos=1)
    def pose(self, message: PoseStamped) -> None:
        self._pose = from_pose(message.pose)

    @PATH.on()
    def path(self, message: PathMessage) -> None:
        points = [(pose.pose.position.x, pose.pose.position.y) for pose in message.poses]
        self._path = Path(np.array(points)) if points else None

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._battery = message

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @DRIVE_STATUS.on()
    def drive(self, message: DriveStatus) -> None:
        self._driver, self._standing = message.source, message.reason

    @every(hz=2)
    def renew(self) -> None:
        if self._line.live:
            self._line.show(self._parts())

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

    def _parts(self) -> list[Part]:
        parts = [Part(9, f"{self.clock.now():7.1f} s")]
        if self._driver == "autonomy" and self._path is not None and self._pose is not None:
            (x, y), (along, off) = self._path.points[-1].tolist(), self._path.project(self._pose.x, self._pose.y)
            parts.append(Part(8, f"{self._path.length - along + off:.1f} m to ({x:.2f}, {y:.2f})"))
        elif self._driver or self._standing:
            parts.append(Part(3, f"{self._driver} drives" if self._driver else self._standing))
        if self._pose is not None:
            parts.append(Part(5, _place(self._pose)))
        parts.append(Part(6, f"gait {self._mode}"))
        if self._battery is not None:
            charging = self._battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
            charge = f"battery {100 * self._battery.percentage:.1f} %"
            parts.append(Part(6, f"{charge}, charging" if charging else charge))
            parts.append(Part(2, f"{self._battery.voltage:.2f} V"))
        parts += [Part(1, f"{self._backend} body"), Part(7, "Ctrl-C stops")]
        return parts


def _place(pose: Pose2) -> str:
    return f"x {pose.x:5.2f} y {pose.y:5.2f} heading {degrees(pose.yaw):4.0f} deg"
