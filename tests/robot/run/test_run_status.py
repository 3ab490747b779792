"""The line that renews itself below the log of `python -m robot run`: what it says, what it leaves out, and how it ends."""

from __future__ import annotations

import io
import os
import shutil

import numpy as np
import pytest

from actors import Child
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.logs import LogRecord
from actors.logs.levels import Level
from actors.testing import Rig
from robot.contracts import BATTERY_STATE, DRIVE_STATUS, GAIT_STATUS, PATH, POSE
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import DriveStatus, GaitStatus
from robot.run.judge import Score
from robot.run.status import Part, Status, StatusLine, final_parts, fitting
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody

CLEAR = "\r\x1b[2K\x1b[J"
STAMP = PoseStamped().header.stamp


class Terminal(io.StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True

    @property
    def last(self) -> str:
        """What stands in the line."""
        return self.getvalue().rpartition(CLEAR)[2].rstrip("\r\n")


@pytest.fixture
def columns(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    width = {"columns": 160}
    monkeypatch.setattr(shutil, "get_terminal_size", lambda: os.terminal_size((width["columns"], 24)))
    return width


def record(event: str) -> LogRecord:
    return LogRecord(time=1.0, level=Level.INFO, node="/n", incarnation=1, event=event, fields={})


PARTS = (Part(9, "first"), Part(1, "least"), Part(5, "middle"))


def test_what_does_not_fit_is_left_out_by_rank_and_the_order_stays() -> None:
    assert fitting(PARTS, 80) == "first | least | middle"
    assert fitting(PARTS, 21) == "first | middle"
    assert fitting(PARTS, 13) == "first"
    assert fitting(PARTS, 3) == "fir"


def test_the_cursor_waits_before_the_line_so_that_a_narrower_terminal_leaves_nothing_behind(
    columns: dict[str, int],
) -> None:
    terminal = Terminal()
    line = StatusLine(terminal)
    line.show(PARTS)
    assert terminal.getvalue() == f"{CLEAR}first | least | middle\r"
    columns["columns"] = 20
    line.show(PARTS)
    assert terminal.last == "first | middle"


def test_log_lines_scroll_by_above_it_but_for_those_that_say_the_same(columns: dict[str, int]) -> None:
    terminal, lines = Terminal(), list[str]()
    line = StatusLine(terminal)
    sink = line.above(lambda one: lines.append(one.event))
    sink(record("before"))
    assert terminal.getvalue() == ""
    line.show(PARTS)
    sink(record("robot"))
    sink(record("hello"))
    assert lines == ["before", "hello"]
    assert terminal.getvalue().endswith(f"{CLEAR}{CLEAR}first | least | middle\r")


def test_the_end_is_the_final_state_on_a_line_of_its_own(columns: dict[str, int]) -> None:
    terminal = Terminal()
    line = StatusLine(terminal)
    line.show(PARTS)
    line.end([Part(1, "over")])
    assert terminal.getvalue().endswith(f"{CLEAR}over\r\n")
    line.end([Part(1, "again")])
    assert "again" not in terminal.getvalue()


def test_a_line_that_was_never_shown_leaves_nothing() -> None:
    terminal = Terminal()
    StatusLine(terminal).end([Part(1, "over")])
    assert terminal.getvalue() == ""


async def test_it_says_where_the_robot_goes_how_far_it_is_and_what_stops_it(rig: Rig, columns: dict[str, int]) -> None:
    terminal = Terminal()
    await rig.start(Child(Status, args=(StatusLine(terminal), "physics")))
    await rig.advance(0.6)
    assert terminal.last == "    0.5 s | gait - | physics body | Ctrl-C stops"
    rig.publish(POSE, pose_stamped(Pose2(1.0, 0.0, 0.0), STAMP))
    rig.publish(PATH, Path(poses=[pose_stamped(Pose2(x, y), STAMP) for x, y in ((0.0, 0.0), (3.0, 0.0), (3.0, 4.0))]))
    rig.publish(GAIT_STATUS, GaitStatus(mode="walk"))
    rig.publish(DRIVE_STATUS, DriveStatus(enabled=True, source="autonomy", reason="autonomy"))
    rig.publish(BATTERY_STATE, BatteryState(percentage=0.899, voltage=12.1))
    await rig.advance(0.5)
    assert terminal.last == (
        "    1.0 s | 6.0 m to (3.00, 4.00) | x  1.00 y  0.00 heading    0 deg | gait walk | battery 89.9 % | 12.10 V | "
        "physics body | Ctrl-C stops"
    )
    columns["columns"] = 80
    await rig.advance(0.5)
    assert terminal.last == "    1.5 s | 6.0 m to (3.00, 4.00) | gait walk | battery 89.9 % | Ctrl-C stops"
    rig.publish(DRIVE_STATUS, DriveStatus(enabled=True, reason="nobody drives"))
    await rig.advance(0.5)
    assert "to (3.00, 4.00)" not in terminal.last
    await rig.close()
    assert terminal.last == "    2.1 s | stopping"


@pytest.mark.parametrize(("charging", "battery"), [(False, "battery 42.0 %"), (True, "battery 42.0 %, charging")])
def test_the_final_state_is_that_of_the_true_body(charging: bool, battery: str) -> None:
    body = KinematicBody(get_world("empty"), seed=1)
    parts = final_parts(body.truth(), Score(charge=0.42, charging=charging), 12.34)
    assert [part.text for part in parts] == ["   12.3 s", "the robot sits", "x  0.00 y  0.00 heading    0 deg", battery]


def test_a_robot_that_lies_on_its_back_has_fallen_and_one_that_is_high_stands() -> None:
    from dataclasses import replace

    truth = KinematicBody(get_world("empty"), seed=1).truth()
    assert final_parts(replace(truth, fallen=True), Score(), 1.0)[1].text == "the robot has fallen"
    assert final_parts(replace(truth, position=np.array([0.0, 0.0, 0.45])), Score(), 1.0)[1].text == "the robot stands"
