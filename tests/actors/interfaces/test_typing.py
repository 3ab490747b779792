"""What type checkers see of messages: lines that end in `# E` are wrong and no others, for mypy and for pyright."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

SAMPLE = """
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

from actors.interfaces import Message, ServiceType, decode, encode, get_message
from actors.interfaces.geometry_msgs.msg import Point, Twist, Vector3
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import Image, Imu, JointState
from actors.interfaces.std_msgs.msg import Float32, String
from actors.interfaces.std_srvs.srv import SetBool
from actors.interfaces.types import AtMost, Chars, Exactly, Many, default, float64, float64_array, int32_array, string, uint8


class Pose2D(Message, frozen=True, kw_only=True):
    LIMIT: ClassVar[uint8] = 5
    x: float64 = 0.0
    label: Annotated[string, Chars(10)] = ""
    path: Many[Point] = default()
    covariance: Annotated[float64_array, Exactly(9)] = default()
    codes: Annotated[int32_array, AtMost(5)] = default([1, 2])


class Bare(Message):  # E
    x: float64 = 0.0


class Plan_Request(Message, frozen=True, kw_only=True):
    start: Point = default()


class Plan_Response(Message, frozen=True, kw_only=True):
    success: bool = False


class Plan(ServiceType[Plan_Request, Plan_Response]):
    Request: TypeAlias = Plan_Request
    Response: TypeAlias = Plan_Response


def call(service: type[ServiceType[Any, Any]]) -> None: ...


pose = Pose2D(x=1, path=[Point(x=1)], covariance=[0.0] * 9, codes=np.zeros(2, np.int32))
assert_type(pose.x, float)
assert_type(pose.label, str)
assert_type(pose.path, tuple[Point, ...])
assert_type(pose.covariance, NDArray[np.float64])
assert_type(pose.replace(x=2), Pose2D)
assert_type(decode(Pose2D, encode(pose)), Pose2D)
assert_type(Imu().orientation_covariance, NDArray[np.float64])
assert_type(Image(data=b"ab").data, NDArray[np.uint8])
assert_type(JointState(name=("a", "b"), position=[1, 2.0]).name, tuple[str, ...])
assert_type(SetBool.Response().success, bool)
assert_type(Plan.Request(start=Point()).start, Point)
assert_type(get_message("std_msgs/String"), type[Message])
call(Plan)
call(SetBool)
Twist(linear=Vector3(x=0.5))
Twist(linear=Float32())  # E
Twist(lineal=Vector3())  # E
Point(1.0, 2.0, 3.0)  # E
String(data=3)  # E
Float32(data="fast")  # E
Pose2D(x="far")  # E
Pose2D(path=[Vector3()])  # E
Pose2D(covariance="123")  # E
Path(poses=[Point()])  # E
Image(data="text")  # E
pose.x = 3.0  # E
pose.covariance = np.zeros(9)  # E
SetBool.Response(success="yes")  # E
call(Point)  # E
"""


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    path = tmp_path / "sample.py"
    path.write_text(SAMPLE)
    return path


def marked() -> set[int]:
    return {number for number, line in enumerate(SAMPLE.splitlines(), 1) if line.endswith("# E")}


@pytest.mark.slow(reason="a type checker reads the whole package")
def test_mypy_finds_what_is_wrong_and_nothing_else(sample: Path) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed: pip install --group lint")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--hide-error-context", str(sample)]
    output = subprocess.run(command, capture_output=True, text=True, cwd=ROOT).stdout
    found = {int(number) for number in re.findall(r"sample\.py:(\d+): error", output)}
    assert found == marked(), output


@pytest.mark.slow(reason="a type checker reads the whole package")
def test_pyright_finds_what_is_wrong_and_nothing_else(sample: Path) -> None:
    if shutil.which("pyright", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("pyright is not installed: pip install --group lint")
    config = {
        "typeCheckingMode": "strict",
        "include": ["sample.py"],
        "extraPaths": [str(ROOT)],
        "pythonVersion": "3.11",
    }
    (sample.parent / "pyrightconfig.json").write_text(json.dumps(config))
    command = [
        str(Path(sys.executable).parent / "pyright"),
        "--outputjson",
        "--pythonpath",
        sys.executable,
        "-p",
        str(sample.parent),
    ]
    output = subprocess.run(command, capture_output=True, text=True).stdout
    report = json.loads(output)["generalDiagnostics"]
    found = {item["range"]["start"]["line"] + 1 for item in report if item["severity"] == "error"}
    assert found == marked(), output
