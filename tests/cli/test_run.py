# pyright: reportPrivateUsage=false
"""`run PACKAGE EXECUTABLE` and `run MODULE:NODE`: nodes and programs, with the arguments of ROS 2."""

from __future__ import annotations

import asyncio
import signal
import subprocess
from pathlib import Path

import pytest

from cli.verbs.run import _run_process as run_process
from tests.cli.conftest import ROOT, Command, Finished, Start
from tests.facts import lacks

MODULE = """
import asyncio
from actors import Child, Node, Supervisor, background, every, parameter, publishes, Topic
from actors.interfaces.std_msgs.msg import String

class Greeter(Node):
    text = parameter("hello")
    out = publishes(Topic(String, "greeting", 10))

    async def on_start(self):
        self.log.info(f"I say {self.text} on {self.out}")

    @every(hz=20)
    def greet(self):
        self.out(String(data=self.text))

class Leaver(Node):
    @background
    async def leave(self):
        self.stop("enough")

class Broken(Node):
    async def on_start(self):
        raise RuntimeError("no camera")

class Falls(Node):
    async def on_start(self):
        self.log.info("born")

    @every(hz=20)
    def fall(self):
        raise ValueError("tripped")

def guarded():
    return Supervisor("guard", children=[Child(Falls)])

class Exits(Node):
    @background
    async def leave(self):
        raise SystemExit(7)
"""


@pytest.fixture
def here(tmp_path: Path, environment: dict[str, str]) -> Path:
    (tmp_path / "garden.py").write_text(MODULE)
    (tmp_path / "shed.py").write_text("import ladder")
    environment["PYTHONPATH"] = f"{ROOT}:{tmp_path}"
    return tmp_path


async def test_a_node_of_the_user_ends_with_the_code_of_its_end(here: Path, robot: Command) -> None:
    left = await robot("run", "garden:Leaver")
    assert (left.code, left.err) == (0, "")
    broken = await robot("run", "garden:Broken")
    assert broken.code == 1
    assert broken.err.endswith("broken did not start: it raised RuntimeError: no camera (in the tree: run/broken)\n")
    fell = await robot("run", "garden:Falls")
    assert fell.code == 1
    assert "ValueError: tripped" in fell.err
    assert fell.out.count("born") == 1, "a program is not started again"
    assert (await robot("run", "garden:Exits")).code == 7


async def test_a_node_that_crashes_is_told_with_its_error_its_name_and_how_often(here: Path, robot: Command) -> None:
    fell = await robot("run", "garden:guarded")
    ends = [line for line in fell.out.splitlines() if "child terminated" in line]
    assert len(ends) == 4
    assert all("child=guard/falls" in line and "it raised ValueError: tripped" in line for line in ends)
    assert [line.partition("times=")[2] for line in ends] == ["", "2", "3", "4"]
    assert [f"restarted falls (life {life})" in fell.out for life in (2, 3, 4, 5)] == [True, True, True, False]
    assert 'raise ValueError("tripped")' in fell.out + fell.err, "the line of the user is shown"
    assert fell.code == 1


async def test_an_import_that_fails_names_the_module_and_the_line(here: Path, robot: Command) -> None:
    refused = await robot("run", "shed:Node")
    assert (refused.code, refused.out) == (1, "")
    assert lacks(refused.err, f"shed 'ladder' {here / 'shed.py'}:1") == []


async def test_what_is_not_installed_is_answered_with_what_there_is(here: Path, robot: Command) -> None:
    refused = await robot("run", "my_robot_pkg", "fibonacci_server")
    assert refused.code == 1
    assert refused.err == (
        "No executable found: package 'my_robot_pkg' has no executable 'fibonacci_server'; did you mean 'fibonacci_action_server'? "
        "(there are: distance_service, fibonacci_action_client, fibonacci_action_server, minimal_client, minimal_service, "
        "service_client, service_server)\n"
    )


async def test_ros_arguments_rename_and_set(here: Path, start: Start, robot: Command) -> None:
    words = ("--ros-args", "-r", "greeting:=/news", "-r", "__node:=ann", "-r", "__ns:=/left", "-p", "text:=good day")
    process = await start("run", "garden:Greeter", *words)
    heard = await robot("topic", "echo", "/news", "std_msgs/msg/String", "--once")
    assert (heard.code, heard.out) == (0, "data: good day\n---\n")
    assert (await robot("node", "list")).out == "/left/ann\n"
    process.send_signal(signal.SIGINT)
    async with asyncio.timeout(30):
        _, error = await process.communicate()
    assert (process.returncode, error) == (130, b"")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("run", "garden:Gretter"), "'garden:Gretter': garden has nothing of the name 'Gretter'; trees that it has: "),
        (("run", "nowhere:Node"), "no module named 'nowhere', neither here in "),
        (("run", "my_robot_contrller", "talker"), "Package 'my_robot_contrller' not found; did you mean 'my_robot_controller'?"),
        (("run", "my_robot_controller", "talkr"), "No executable found: package 'my_robot_controller' has no executable 'talkr'"),
        (("run", "my_robot_controller"), "which executable? my_robot_controller has: add_client, "),
        (("run", "garden:Greeter", "--ros-args", "-e", "/x"), "this flag of ROS 2 has no effect here; leave it out (in: --ros-args --enclave)"),
        (("run", "garden:Greeter", "--ros-args", "-p", "txt:=x"), "-p txt:=x: /**: there is no parameter 'txt'; did you mean 'text'?"),
        (("run", "garden:Greeter", "--ros-args", "--params-file", "no.yaml"), "no.yaml"),
        (("run", "garden:Greeter", "--ros-args", "--log-level", "loud"), "'loud'"),
    ],
)  # fmt: skip
async def test_what_cannot_be_run_is_one_line(words: tuple[str, ...], error: str, here: Path, robot: Command) -> None:
    refused = await robot(*words)
    assert (refused.code, refused.out) == (1, "")
    assert error in refused.err
    assert refused.err.count("\n") == 1


@pytest.mark.parametrize("word", ["garden", "garden.py"])
async def test_a_file_that_is_named_as_a_package_is_told_how(
    word: str, here: Path, environment: dict[str, str], robot: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(here)
    refused = await robot("run", word)
    assert (refused.code, refused.out) == (1, "")
    assert lacks(refused.err, "garden.py package garden:Greeter garden:Leaver garden:Broken python garden.py") == []
    (here / "half.py").write_text("class Half(")
    assert "did you mean half:NAME" in (await robot("run", "half")).err


async def test_an_argument_of_ros_in_the_wrong_place_is_told(here: Path, robot: Command) -> None:
    left = await robot("run", "garden:Leaver", "-p", "text:=x")
    assert left.code == 0
    assert "not after --ros-args, so not a parameter" in left.out
    assert "argument='-p text:=x'" in left.out
    assert "argument='text:=x'" in (await robot("run", "garden:Leaver", "text:=x")).out


async def test_a_second_node_is_told_to_be_an_argument(here: Path, robot: Command) -> None:
    ended = await robot("run", "garden:Leaver", "garden:Greeter")
    assert ended.code == 0
    assert ended.err.startswith("[robactor run]: garden:Greeter is an argument of garden:Leaver, not a second node: ")


async def test_an_option_behind_the_name_is_told_to_be_an_argument(here: Path, robot: Command) -> None:
    ended = await robot("run", "garden:Leaver", "--duration", "3")
    assert ended.code == 0
    assert ended.err.startswith("[robactor run]: --duration is an argument of garden:Leaver, in system.argv; ")
    assert "is an argument of" not in (await robot("run", "garden:Leaver", "--ros-args", "-r", "a:=b")).err


async def test_a_program_of_an_installed_package_gets_its_words_and_gives_its_code(
    tmp_path: Path, environment: dict[str, str], robot: Command
) -> None:
    program = tmp_path / "lib" / "garden" / "gnome"
    program.parent.mkdir(parents=True)
    program.write_text('#!/bin/sh\necho "$@"\nexit 5\n')
    program.chmod(0o755)
    environment["AMENT_PREFIX_PATH"] = str(tmp_path)
    ran = await robot("run", "garden", "gnome", "--ros-args", "-r", "a:=b", "--ros2-exit-codes")
    assert ran == Finished(
        5, "--ros-args -r a:=b --ros2-exit-codes\n", "[robactor run]: Process exited with failure 5\n"
    )
    prefixed = await robot("run", "--prefix", "echo by", "garden", "gnome", "--help")
    assert prefixed == Finished(0, f"by {program} --help\n", "")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_that_comes_while_the_program_is_being_started_ends_the_program(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It comes when the program runs already, and nobody knows it yet. The handlers are those of before afterwards."""
    missed: list[int] = []
    before = signal.signal(number, lambda number, frame: missed.append(number))
    handlers = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
    started: list[subprocess.Popen[bytes]] = []

    class Interrupted(subprocess.Popen[bytes]):
        def __init__(self, words: list[str]) -> None:
            super().__init__(words)
            started.append(self)
            signal.raise_signal(number)

    monkeypatch.setattr("cli.verbs.run.subprocess.Popen", Interrupted)
    try:
        assert run_process(["sleep", "5"]) == 128 + number
    finally:
        (process,) = started
        process.kill()
        process.wait()
        now = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
        signal.signal(number, before)
    assert now == handlers
    assert missed == []
