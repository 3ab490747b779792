"""The command `launch`: what it prints, what it starts, and its exit codes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cli.command import run_command
from tests import warm
from tests.actors.launch.files import python, written, xml
from tests.wires import BOTH


def launched(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[str], str]:
    """Exit code, lines on stdout, text on stderr."""
    try:
        code = run_command("launch", words)
    except SystemExit as exit:
        code = int(exit.code or 0)
    out, err = capsys.readouterr()
    return code, out.splitlines(), err


def test_the_launch_file_of_the_tutorial_starts_the_three_nodes(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines, err = launched(
        capsys, "humanoid_control", "humanoid_system.launch.py", "--clock", "virtual", "--duration", "5"
    )

    assert (code, err) == (0, "")
    for name in ("sensor_simulator-1", "planner-2", "motor_controller-3"):
        assert any(f"[{name}] process started" in line for line in lines)
    assert any("Received trajectory with 10 waypoints" in line for line in lines)


def test_a_remapping_and_parameters_of_the_tutorials_launch_files_take_effect(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, tree, _ = launched(capsys, "camera_driver", "camera.launch.xml", "--show-tree")
    _, lines, _ = launched(capsys, "control", "motor.launch.xml", "--clock", "virtual", "--duration", "1")

    assert tree == [
        "camera.launch.xml (supervisor, one_for_one)",
        "└─ camera_node-1: camera_driver/camera_node as /camera (robot.tutorials.camera_detector:Camera)",
        "   └─ /camera/image -> /perception/camera/rgb",
    ]
    assert any("Max velocity: 1.0" in line for line in lines)
    assert any("PID gains: [1.0, 0.1, 0.01]" in line for line in lines)


PROGRAM = """
import sys
from launch import LaunchDescription, LaunchService
from launch_ros.actions import Node
service = LaunchService(argv=sys.argv[1:])
service.include_launch_description(LaunchDescription([Node(package='my_robot_pkg', executable='service_clint')]))
sys.exit(service.run())
"""


def test_a_program_that_starts_its_launch_itself_is_run_but_cannot_be_shown(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = written(tmp_path, "program.py", PROGRAM)

    code, _, err = launched(capsys, str(path), "a:=1")
    assert code == 1
    assert f"{path}:6: package 'my_robot_pkg' has no executable 'service_clint'; did you mean 'service_client'?" in err
    code, lines, err = launched(capsys, str(path), "--show-tree")
    assert (code, lines) == (1, [])
    assert "starts its launch itself, so it can only be run" in err


LAUNCH_TEST = """
import unittest
import launch_testing
from launch import LaunchDescription
from launch.actions import *
from launch_testing.actions import ReadyToTest

@launch_testing.parametrize('number', [1, 2, 3])
def generate_test_description(number):
    if number == 2:
        raise unittest.SkipTest('not two')
    return LaunchDescription([DeclareLaunchArgument('word', default_value='a'), ReadyToTest(), TimerAction(period=60.0, actions=[])])

class TestActive(unittest.TestCase):
    def test_number(self, number, test_args):
        self.assertNotEqual(str(number), test_args['word'])
"""


def checked(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = run_command("launch_test", words)
    return code, *capsys.readouterr()


def test_a_launch_test_is_run_once_for_each_row_and_its_failures_are_listed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = str(written(tmp_path, "some_launch_test.py", LAUNCH_TEST))

    code, _, err = checked(capsys, path, "word:=3")

    assert code == 1
    assert "some_launch_test.py[2] is skipped: not two" in err.splitlines()
    failed = [line for line in err.splitlines() if line.startswith("FAILED some")]
    assert len(failed) == 1
    assert failed[0].startswith("FAILED some_launch_test.py[3] ")
    assert failed[0].endswith("TestActive.test_number: AssertionError: '3' == '3'")
    assert checked(capsys, path, "word:=4")[0] == 0


def test_a_launch_test_shows_its_arguments_and_is_refused_where_it_is_none(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = str(written(tmp_path, "some_launch_test.py", LAUNCH_TEST))

    code, out, _ = checked(capsys, path, "--show-args")
    assert (code, out.splitlines()[2:]) == (
        0,
        ["    'word':", "        no description given", "        (default: 'a')"],
    )
    assert checked(capsys, "/no/such.py")[::2] == (1, "there is no file /no/such.py\n")
    assert "has no function generate_test_description()" in checked(capsys, str(written(tmp_path, "a.py", "")))[2]


def test_arguments_are_given_and_the_last_one_counts(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("my_robot_controller", "talkers.launch.yaml", "seconds:=1", "seconds:=3", "--clock", "virtual")

    code, lines, _ = launched(capsys, *words)

    assert code == 0
    assert any("3.000" in line and "the time is over" in line for line in lines)
    assert any("Received: Hello World 0" in line and "/kitchen/listener" in line for line in lines)


def test_arguments_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines, _ = launched(capsys, "-s", "my_robot_controller", "talkers.launch.yaml")

    assert (code, lines) == (
        0,
        [
            "Arguments (pass arguments as '<name>:=<value>'):",
            "",
            "    'seconds':",
            "        When the launch ends, s.",
            "        (default: '5.0')",
        ],
    )


def test_an_argument_that_the_file_does_not_declare_is_warned_of(capsys: pytest.CaptureFixture[str]) -> None:
    _, _, err = launched(capsys, "--show-tree", "my_robot_controller", "talkers.launch.yaml", "secnds:=1")

    assert err == "warning: the launch file declares no argument 'secnds'; did you mean 'seconds'?\n"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("humanoid_control", "humanoid_systm.launch.py"), "did you mean 'humanoid_system.launch.py'?"),
        (("humanoid_contrl", "x.launch.py"), "package 'humanoid_contrl' not found; did you mean 'humanoid_control'?"),
        (("nothing.launch.py",), "there is no launch file nothing.launch.py; or write PACKAGE FILE"),
        (("nothing.launch.py", "a:=b"), "there is no launch file nothing.launch.py"),
        (
            ("humanoid_control", "humanoid_system.launch.py", "x=1"),
            "malformed launch argument 'x=1', expected format '<name>:=<value>'",
        ),
        (("humanoid_control", "humanoid_system.launch.py", ":=1"), "malformed launch argument ':=1'"),
        (("--package-path", "/no/such/folder", "a", "b"), "--package-path: [Errno 2] No such file or directory"),
    ],
)
def test_what_cannot_be_launched_is_said_in_one_line(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], text: str
) -> None:
    code, lines, err = launched(capsys, *words)

    assert (code, lines) == (1, [])
    assert text in err and "Traceback" not in err


def test_a_launch_file_that_was_not_installed_is_answered_with_those_that_were(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, lines, err = launched(capsys, "humanoid_control", "lab.launch.py")

    assert (code, lines) == (1, [])
    assert "no file 'lab.launch.py'" in err
    assert "(there are: camera.launch.xml, humanoid_system.launch.py, motor.launch.xml, talkers.launch.yaml)" in err


def test_a_launch_file_with_a_mistake_starts_nothing_and_names_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = xml(tmp_path, '<node pkg="control" exec="motor_node"/>\n<node pkg="control" exec="moter_node"/>')

    code, lines, err = launched(capsys, str(path))

    assert (code, lines) == (1, [])
    assert err.startswith(f"{path}:3: package 'control' has no executable 'moter_node'; did you mean 'motor_node'?")


def test_a_slip_in_a_python_launch_file_is_named_with_its_line_and_the_argument_that_was_meant(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # the path is relative, as a user types it
    text = "from launch_ros.actions import Node\ndef generate_launch_description():\n    return [\n        Node(executable='b', nam='c')]\n"
    (tmp_path / "slip.launch.py").write_text(text)

    code, lines, err = launched(capsys, "--check", "slip.launch.py")

    assert (code, lines) == (1, [])
    assert err == "slip.launch.py:4: TypeError: Node() has no argument nam; did you mean 'name'?\n"


def test_check_names_everything_that_is_wrong_and_starts_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    wrong = xml(
        tmp_path,
        '<node pkg="a" exec="b"/>\n<node pkg="a" exec="b"/><log message="$(var x)"/><include file="/nowhere"/>',
    )

    code, lines, err = launched(capsys, "--check", str(wrong))
    fine = launched(capsys, "--check", "humanoid_control", "humanoid_system.launch.py")

    assert (code, lines) == (1, [])
    assert err.splitlines()[0].startswith(f"{wrong}:2 (and 1 more): package 'a' not found")
    assert len(err.splitlines()) == 3
    assert fine == (0, ["nothing is wrong"], "")


def test_a_tree_is_shown_although_something_is_missing(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "ws" / "driver").mkdir(parents=True)
    path = xml(tmp_path, '<node pkg="driver" exec="lidar" name="front"/>')

    code, lines, err = launched(capsys, "--show-tree", "--package-path", str(tmp_path / "ws"), str(path))

    assert (code, lines[1:]) == (0, ["└─ lidar-1: driver/lidar as /front (not here)"])
    assert "package 'driver' has no executable 'lidar' (there is none)" in err


def test_stand_ins_take_the_place_of_what_is_not_here(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<node pkg="driver" exec="lidar" name="front"><param name="a" value="1"/><param from="/none.yaml"/></node>',
    )

    code, lines, err = launched(capsys, "--stand-ins", str(path), "--clock", "virtual", "--duration", "1")

    assert code == 0 and any("[lidar-1] process started" in line for line in lines)
    assert "warning: " in err and "parameter file /none.yaml cannot be read" in err


def test_debug_shows_debug_lines(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = xml(tmp_path, '<log level="debug" message="fine print"/>')

    quiet = launched(capsys, str(path), "--clock", "virtual")[1]
    loud = launched(capsys, str(path), "-d", "--clock", "virtual")[1]

    assert [any("fine print" in line for line in lines) for lines in (quiet, loud)] == [False, True]


def started(path: Path, *words: str, place: dict[str, str]) -> subprocess.Popen[str]:
    env = {**os.environ, **place}
    command = [sys.executable, "-m", "robot", "launch", str(path), *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)


@pytest.mark.realtime
@BOTH
def test_ctrl_c_ends_everything_within_two_seconds(tmp_path: Path, place: dict[str, str]) -> None:
    path = python(
        tmp_path,
        "Node(package='humanoid_control', executable='planner'), ExecuteProcess(cmd=['sleep', '60']), "
        "RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg='bye')]))",
    )
    process = started(path, place=place)
    assert process.stdout is not None
    heard = ""
    while "sleep-2] process started" not in heard:
        line = process.stdout.readline()
        assert line, process.communicate()[1]
        heard += line

    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=30)

    assert process.returncode == 130
    assert time.monotonic() - begun < 2.0
    assert "bye" in rest and "sending signal 'SIGINT'" in rest


@pytest.mark.realtime
def test_output_of_processes_is_shown_as_asked_and_a_prefix_is_put_before(
    tmp_path: Path, place: dict[str, str]
) -> None:
    path = xml(tmp_path, '<executable cmd="echo hello"/>')

    process = started(path, "-a", "--launch-prefix", "env WORD=x", "--launch-prefix-filter", "echo", place=place)
    out, err = process.communicate(timeout=30)

    assert (process.returncode, err) == (0, "")
    assert "[echo-1] hello" in out


def test_a_package_of_the_user_is_launched_by_its_name(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    written(tmp_path, "ws/mine/package.xml", "<package><name>mine</name></package>")
    written(tmp_path, "ws/mine/launch/a.launch.xml", "<launch><log message='$(find-pkg-share mine)'/></launch>")

    code, lines, _ = launched(
        capsys, "--package-path", str(tmp_path / "ws"), "mine", "a.launch.xml", "--clock", "virtual"
    )

    assert code == 0 and str(tmp_path / "ws" / "mine") in lines[0]


@pytest.mark.parametrize("look", ["--show-tree", "--show-args", "--check"])
def test_a_file_that_cannot_be_read_is_no_tree(capsys: pytest.CaptureFixture[str], tmp_path: Path, look: str) -> None:
    path = written(tmp_path, "a.launch.py", "def generate_launch_description(:\n")

    code, _, err = launched(capsys, str(path), look)

    assert code == 1
    assert f"{path}:1: " in err


def test_a_copy_of_a_file_that_a_substitution_makes_ends_with_the_program(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("node:\n  ros__parameters: {a: 1}\n")
    (tmp_path / "copy.launch.py").write_text(
        "from launch import LaunchDescription\nfrom launch.actions import LogInfo\nfrom nav2_common.launch import RewrittenYaml\n"
        "def generate_launch_description():\n"
        "    return LaunchDescription([LogInfo(msg=RewrittenYaml('p.yaml', {'a': '2'}))])\n"
    )
    (tmp_path / "tmp").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "tmp"), "RMW_IMPLEMENTATION": "in_process"}
    done = warm.run("launch", "copy.launch.py", cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "tmp") in done.stdout
    assert list((tmp_path / "tmp").iterdir()) == []
