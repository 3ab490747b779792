"""A launch file that is only looked at: what would act outside of the process is refused, and said."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import pytest

from actors.launch import LaunchError, NotDone
from cli.command import run_command
from tests.actors.launch.files import launch, python, tree, written, xml

ACTS = {
    "removes": "os.remove({0!r})",
    "writes": "open({0!r}, 'w')",
    "appends": "os.open({0!r}, os.O_APPEND | os.O_WRONLY)",
    "runs": "subprocess.run(['rm', {0!r}])",
    "asks a shell": "os.system('rm ' + {0!r})",
    "makes a folder": "os.mkdir({0!r} + '.d')",
    "moves": "shutil.move({0!r}, {0!r} + '.old')",
    "makes a temporary file": "tempfile.mkstemp(dir=os.path.dirname({0!r}))",
    "connects": "socket.create_connection(('127.0.0.1', 9), 1)",
}
FILE = """
import os, shutil, socket, subprocess, tempfile
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction

def act(context):
    {act}

def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=act), LogInfo(msg="after"), DeclareLaunchArgument("x", default_value="1")])
"""


@pytest.mark.parametrize("act", ACTS.values(), ids=ACTS)
def test_what_acts_is_not_done_and_the_rest_is_shown(tmp_path: Path, act: str) -> None:
    precious = written(tmp_path, "precious", "as it was")
    path = written(tmp_path, "a.launch.py", FILE.format(act=act.format(str(precious))))

    shown = launch(path, lenient=True)

    assert precious.read_text() == "as it was"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.launch.py", "precious"]
    (problem,) = shown.problems
    assert isinstance(problem, NotDone)
    assert "is not done while the launch file is only looked at" in str(problem)
    assert shown.show().splitlines()[-1].endswith("log info: after")
    assert shown.arguments == ["x"]


@pytest.mark.parametrize(
    "act",
    ["open(__file__).close()", "open(os.devnull, 'w').close()", "tempfile.TemporaryFile().close()", "os.listdir()"],
)
def test_what_leaves_no_trace_is_done(tmp_path: Path, act: str) -> None:
    path = written(tmp_path, "a.launch.py", FILE.format(act=act))

    assert launch(path, lenient=True).problems == []


def test_a_file_that_acts_while_it_is_read_is_not_read_on(tmp_path: Path) -> None:
    path = written(tmp_path, "a.launch.py", "from pathlib import Path\nPath(__file__).unlink()\n")

    shown = launch(path, lenient=True)

    assert path.exists()
    assert shown.is_broken
    assert str(shown.problems[0]).startswith(f"{path}:2: os.remove(")


def test_other_code_acts_as_ever_beside_and_afterwards(tmp_path: Path) -> None:
    launch(python(tmp_path, "LogInfo(msg='x')"), lenient=True)

    (tmp_path / "after").write_text("x")
    assert subprocess.run(["true"], check=False).returncode == 0
    with tempfile.NamedTemporaryFile(dir=tmp_path) as file:
        assert Path(file.name).exists()


def test_no_command_runs_and_what_depends_on_one_is_said(tmp_path: Path) -> None:
    made = tmp_path / "made"
    path = xml(
        tmp_path,
        f"""<let name="text" value="$(command 'touch {made}')"/>
        <log message="$(var text)"/>
        <log if="$(command 'touch {made}')" message="never"/>
        <log message="$(command 'no_such_program_here x')"/>""",
    )

    shown = launch(path, lenient=True)

    assert not made.exists()
    assert tree(path, lenient=True)[0] == f"log info: $(command 'touch {made}')"
    condition, absent = shown.problems
    assert isinstance(condition, NotDone)
    assert "depends on a command, which is not run here" in str(condition)
    assert "no program 'no_such_program_here' on the PATH" in str(absent)
    with pytest.raises(LaunchError, match="it must be 'true'"):
        launch(path)
    assert made.exists()


def test_check_finds_nothing_wrong_in_what_it_does_not_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.launch.py", FILE.format(act=f"os.mkdir({str(tmp_path / 'logs')!r})"))

    assert run_command("launch", ["--check", str(path)]) == 0
    out, err = capsys.readouterr()
    assert out == "nothing else is wrong\n"
    assert "os.mkdir(" in err
    assert os.listdir(tmp_path) == ["a.launch.py"]


def test_check_refuses_the_old_words_of_a_static_transform(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    node = "<node pkg='tf2_ros' exec='static_transform_publisher' args='{}'/>"
    path = xml(tmp_path, node.format("1 0 0 0 0 0 map odom"))

    assert run_command("launch", ["--check", str(path)]) == 1
    assert "write --x 1 --y 0 --z 0 --yaw 0 --pitch 0 --roll 0 --frame-id map" in capsys.readouterr().err
    assert "words without names" in str(launch(path).problems[0])  # the other nodes start, as in ROS 2
    assert launch(xml(tmp_path, node.format("--x 1 --frame-id map --child-frame-id odom"))).problems == []
