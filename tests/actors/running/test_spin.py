"""`spin`: a program of one line, with the arguments and the exit codes of ROS 2's programs."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from actors import (
    Child,
    DeclarationError,
    DynamicSupervisor,
    Intensity,
    Node,
    Stop,
    Supervisor,
    background,
    every,
    parameter,
    spin,
    temporary,
)
from actors.running import remove_ros_args
from actors.running.program import live
from actors.supervision import never  # fmt: skip

greetings: list[str] = []


@pytest.fixture(autouse=True)
def nothing_said() -> None:
    greetings.clear()


class Greeter(Node):
    text = parameter("hello", choices=["hello", "adieu"])
    times = parameter(1)

    def __init__(self, whom: str = "you") -> None:
        self.whom = whom

    async def on_start(self) -> None:
        self.count = 0
        if self.whom == "nobody":
            raise RuntimeError("nobody is there")
        if self.whom == "late":
            sys.exit(3)

    @every(hz=200)
    def greet(self) -> None:
        self.count += 1
        greetings.append(f"{self.fqn}: {self.text} {self.whom}")
        if self.whom == "error":
            raise OSError("no voice")
        if self.whom == "exit":
            sys.exit(7)
        if self.whom == "deaf":
            self.log.error("there was no answer", job="failed")
        if self.count == self.times:
            raise Stop("all is said")


class Other(Greeter):
    text = parameter("adieu")


def code_of(*trees: Any, argv: Sequence[str] = ()) -> object:
    """The exit code of a program."""
    try:
        spin(*trees, argv=argv)
    except SystemExit as error:
        return error.code
    return 0


def test_a_node_that_is_done_ends_its_program() -> None:
    assert code_of(Greeter) == 0
    assert greetings == ["/greeter: hello you"]


def test_a_child_says_how_the_node_is_made_and_is_the_program_too() -> None:
    assert code_of(Child(Greeter, args=("world",), name="herald")) == 0
    assert greetings == ["/herald: hello world"]


def test_the_arguments_of_ros_are_for_the_node() -> None:
    argv = ["--fast", "--ros-args", "-r", "__node:=herald", "-p", "text:=adieu", "-p", "times:=2"]
    assert code_of(Greeter, argv=argv) == 0
    assert greetings == ["/herald: adieu you"] * 2


def test_several_nodes_end_their_program_together() -> None:
    assert code_of(Greeter, Child(Other, parameters={"times": 3})) == 0
    assert sorted(greetings) == ["/greeter: hello you", *["/other: adieu you"] * 3]


def test_an_error_is_not_followed_by_a_restart_unless_a_supervisor_is_given(capsys: pytest.CaptureFixture[str]) -> None:
    failing = Child(Greeter, args=("error",))
    assert code_of(failing) == 1
    assert len(greetings) == 1
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "gave up" in told
    assert code_of(Supervisor("guard", children=[failing], intensity=Intensity(2, within=60.0))) == 1
    assert len(greetings) == 1 + 3


def test_what_is_done_below_a_supervisor_does_not_end_the_program() -> None:
    class Last(Node):
        @background
        async def leave(self) -> None:
            await self.clock.sleep(0.05)
            sys.exit(5)

    tree = Supervisor("all", children=[Child(Greeter, restart=temporary), Child(Last)], auto_shutdown=never)
    assert code_of(tree) == 5
    assert greetings == ["/greeter: hello you"]
    assert code_of(DynamicSupervisor("later", Child(Greeter)), Last) == 5


def test_a_start_that_fails_is_told_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert code_of(Child(Greeter, args=("nobody",))) == 1
    told = capsys.readouterr().err
    assert "greeter did not start: it raised RuntimeError: nobody is there" in told and told.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["-p", "text:=halo"], "must be one of 'hello', 'adieu'"),
        (["-p", "tex:=adieu"], "did you mean 'text'?"),
        (["--parm", "text:=adieu"], "unknown ROS arguments"),
    ],
)
def test_a_wrong_argument_is_told_in_a_line(words: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert code_of(Greeter, argv=["--ros-args", *words]) == 2
    told = capsys.readouterr().err
    assert text in told and told.count("\n") == 1 and not greetings


def test_other_processes_are_reached_as_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclone_cpp")
    assert code_of(Greeter) == 2
    assert "RMW_IMPLEMENTATION is rmw_cyclone_cpp: this library speaks rmw_zenoh_cpp" in capsys.readouterr().err


def test_the_exit_of_a_node_is_that_of_the_program() -> None:
    assert code_of(Child(Greeter, args=("exit",))) == 7


def test_a_node_may_exit_during_its_start() -> None:
    assert code_of(Child(Greeter, args=("late",))) == 3


def test_a_job_that_has_failed_is_a_failure_of_the_program_although_all_ended_in_order() -> None:
    assert code_of(Child(Greeter, args=("deaf",)), Other) == 1
    assert sorted(greetings) == ["/greeter: hello deaf", "/other: adieu you"]


def test_what_a_module_has_is_run_as_it_is_a_node_class_too() -> None:
    assert asyncio.run(live([Greeter], [])) == 0
    assert greetings == ["/greeter: hello you"]


def test_what_is_no_part_of_a_tree_is_refused() -> None:
    with pytest.raises(DeclarationError, match=r"spin\(\.\.\.\): .*what runs is a node class"):
        spin(3)  # type: ignore[arg-type]


def test_the_words_for_ros_are_taken_out() -> None:
    words = ["talk.py", "--ros-args", "-p", "a:=1", "--", "--fast", "--ros-args", "-r", "b:=c"]
    assert remove_ros_args(words) == ["talk.py", "--fast"]
    with pytest.raises(ValueError, match="the value after this flag is missing"):
        remove_ros_args(["talk.py", "--ros-args", "-p"])


# -- as a program ---------------------------------------------------------------------------------------------------------------

PROGRAM = """
from actors import Child, Node, every, parameter, spin
from actors.running import remove_ros_args

class Greeter(Node):
    text = parameter("hello")

    def __init__(self, whom):
        self.whom = whom

    @every(hz=50)
    def greet(self):
        print(self.fqn, self.text, self.whom, flush=True)

program, whom = remove_ros_args()
spin(Child(Greeter, args=(whom,)))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_program_takes_the_words_of_its_command_line_and_ends_in_order_by_a_signal(
    tmp_path: Path, number: signal.Signals
) -> None:
    """`ros2 launch` sends SIGINT, and calls every node dead that does not exit with 0 then."""
    path = tmp_path / "greet.py"
    path.write_text(PROGRAM)
    words = [sys.executable, str(path), "world", "--ros-args", "-p", "text:=adieu"]
    environment = {**os.environ, "RMW_IMPLEMENTATION": "in_process"}
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, env=environment, **pipes) as running:
        assert running.stdout is not None and running.stderr is not None
        said = next(line for line in running.stdout if line.startswith("/"))
        running.send_signal(number)
        told = running.stderr.read()
        assert (said, running.wait(30), told) == ("/greeter adieu world\n", 0, "")


SLOW = """
import asyncio, os, signal, sys
from actors import Child, Node, spin

def soon(seconds):
    asyncio.get_running_loop().call_later(seconds, os.kill, os.getpid(), signal.SIGINT)

class Slow(Node):
    async def on_start(self):
        soon(0.0)
        if "start" in sys.argv:
            await asyncio.sleep(3600)

    async def on_stop(self, reason):
        print("stops", flush=True)
        if "stuck" in sys.argv:
            soon(0.6)
            await asyncio.sleep(3600)

spin(Child(Slow, stop=3600.0))
"""


@pytest.mark.parametrize(("how", "code"), [("start", 0), ("stop", 0), ("stuck", 130)])
def test_only_a_signal_that_kills_is_a_failure(how: str, code: int, tmp_path: Path) -> None:
    path = tmp_path / "slow.py"
    path.write_text(SLOW)
    environment = {**os.environ, "RMW_IMPLEMENTATION": "in_process"}
    words = [sys.executable, str(path), how]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60)
    said = [line for line in done.stdout.splitlines() if "[" not in line]  # the log
    assert (done.returncode, said, done.stderr) == (code, ["stops"], "")


class Interrupted(Node):
    """Gets Ctrl-C in its start phase, or later."""

    early = parameter(False)

    async def on_start(self) -> None:
        if self.early:
            signal.raise_signal(signal.SIGINT)
            await asyncio.sleep(3600.0)

    @every(hz=100)
    def tick(self) -> None:
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("early", [True, False])
def test_ctrl_c_at_any_time_is_a_success(early: bool) -> None:
    spin(Child(Interrupted, parameters={"early": early}), argv=[])
