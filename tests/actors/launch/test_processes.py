"""Programs as supervised processes: their command line, their output, and how they are ended. On the real clock, without figures of it."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from actors import run
from actors.launch import LaunchError, Packages
from actors.launch.actions.processes import ExecuteProcess
from actors.launch.parameters import Layer
from actors.launch.plan import NodeSpec, Scope, jobs
from actors.launch.program import ros_arguments
from actors.logs import LogRecord
from actors.parameters.files import ParameterOverrides
from tests.actors.launch.files import context, launch, python, written, xml

IGNORES = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); {more}; print('ready', flush=True); time.sleep(60)"


class Ran:
    """One run of a launch file: the lines of its processes, and its log."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.log: list[str] = []

    def note(self, record: LogRecord) -> None:
        self.log.append(record.event)


async def ran(path: Path, until: Callable[[Ran], bool] | None = None, **options: Any) -> Ran:
    """Run a launch file to its end, or until a condition holds, which is asked after every line."""
    found = Ran()
    changed = asyncio.Event()

    def write(line: str) -> None:
        found.lines.append(line)
        changed.set()

    tree = launch(path, packages=Packages(options.pop("paths", ()), {}), **options).tree(write)
    async with asyncio.timeout(30), run(tree, sinks=(found.note, lambda _: changed.set()), signals=False) as system:
        while until is not None and not until(found):
            await changed.wait()
            changed.clear()
        if until is None:
            await system.wait()
    return found


def test_a_program_of_ros_2_is_told_its_names_parameters_and_remappings(tmp_path: Path) -> None:
    layers = [
        Layer({"rate": 5}, pattern="/**"),
        Layer({"gains": (1.0, 2.0), "name": "é"}),
        Layer({}, "/**: {ros__parameters: {a: 1}}", "/p.yaml"),
        Layer({}, source="/none.yaml"),
    ]
    node = NodeSpec("p", "e", "motor", "/arm", layers, [("a", "b")], ["--fast"], ["--log-level", "debug"], None)

    words = ros_arguments(node, tmp_path)
    files = [words[index + 1] for index, word in enumerate(words) if word == "--params-file"]

    assert [word for word in words if word not in files] == [
        "--fast", "--ros-args", "--log-level", "debug", "-r", "__node:=motor", "-r", "__ns:=/arm",
        "--params-file", "--params-file", "--params-file", "-r", "a:=b",
    ]  # fmt: skip
    overrides = ParameterOverrides()
    for file in files:
        overrides = overrides.with_file(file)
    assert overrides.for_node("/arm/motor") == {"rate": 5, "gains": (1.0, 2.0), "name": "é", "a": 1}
    assert overrides.for_node("/leg") == {"rate": 5, "a": 1}


def test_parameters_of_a_program_without_a_name_are_for_all_its_nodes(tmp_path: Path) -> None:
    words = ros_arguments(NodeSpec("p", "e", None, "", [Layer({"a": 1})], [], [], [], None), tmp_path)

    assert words[:2] == ["--ros-args", "--params-file"]
    assert ParameterOverrides().with_file(words[2]).for_node("/any") == {"a": 1}


def command(path: Path, arguments: dict[str, str] | None = None) -> list[list[str]]:
    """The commands of the processes that a launch file comes to."""
    here = context(arguments=arguments or {})
    from actors.launch.loading import include_file
    from actors.launch.shim import shim

    scope = Scope("launch", "launch")
    with shim(here):
        include_file(path, here, scope)
    return [list(job.process.cmd) for job in jobs(scope) if job.process is not None]


def test_a_prefix_comes_before_the_command_of_the_processes_that_it_is_for(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<executable cmd="ls -l" launch-prefix="nice -n 3"/><executable cmd="/bin/echo x"/><group><log message="x"/><executable cmd="ls"/></group>',
    )

    assert command(path) == [["nice", "-n", "3", "ls", "-l"], ["/bin/echo", "x"], ["ls"]]
    assert command(path, {"launch-prefix": "time -p", "launch-prefix-filter": "ec.o"})[1:] == [
        ["time", "-p", "/bin/echo", "x"],
        ["ls"],
    ]


def test_a_process_has_the_environment_that_was_set_for_it(tmp_path: Path) -> None:
    here, scope = context(), Scope("", "")
    here.environment["A"] = "1"

    ExecuteProcess(cmd=["ls"], additional_env={"B": "2"}).plan(here, scope)
    ExecuteProcess(cmd=["ls"], env={"C": "3"}, output={"stdout": "screen"}, respawn_delay="1.5").plan(here, scope)

    one, other = jobs(scope)
    assert one.process is not None and other.process is not None
    assert one.process.environment == {"HOME": "/home/ros", "A": "1", "B": "2"}
    assert (other.process.environment, other.process.output, other.respawn_delay) == ({"C": "3"}, "both", 1.5)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"cmd": []}, "cmd is empty"), ({"cmd": ["ls"], "sigterm_timeout": "soon"}, "'soon' is no number of seconds")],
)
def test_what_cannot_be_started_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(LaunchError, match=words):
        ExecuteProcess(**options).plan(context(), Scope("", ""))


@pytest.mark.parametrize("remap", [["a"], ["abc"], [3]])
def test_a_remapping_is_a_pair(tmp_path: Path, remap: list[Any]) -> None:
    path = python(tmp_path, f"Node(package='control', executable='motor_node', remappings={remap!r})")

    with pytest.raises(LaunchError, match="a remapping is a pair"):
        launch(path)


@pytest.mark.parametrize(
    ("options", "words"),
    [("name='a-b'", "'a-b' is not a valid node name"), ("namespace='a-b'", "is not a valid namespace")],
)
def test_names_that_ros_does_not_take_are_refused(tmp_path: Path, options: str, words: str) -> None:
    with pytest.raises(LaunchError, match=words):
        launch(python(tmp_path, f"Node(package='control', executable='motor_node', {options})"))


async def test_the_lines_of_a_process_carry_its_label_and_its_end_is_told(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        f"""
        <executable name="tool" cmd="{sys.executable} -c 'import sys; print(1); print(2, file=sys.stderr)'" output="screen"/>
        <executable cmd="sh -c 'echo quiet; exit 3'"/>
        <executable cmd="echo $$WORD" shell="true" output="screen" cwd="/"><env name="WORD" value="spoken"/></executable>
        """.replace("$$", "$"),
    )

    found = await ran(path)

    assert sorted(found.lines) == ["[echo-3] spoken", "[tool-1] 1", "[tool-1] 2"]
    assert any(line.startswith("[tool-1] process has finished cleanly [pid ") for line in found.log)
    assert any(
        "[sh-2] process has died [pid " in line and "exit code 3, cmd 'sh -c echo quiet; exit 3']" in line
        for line in found.log
    )


async def test_all_output_is_shown_where_that_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OVERRIDE_LAUNCH_PROCESS_OUTPUT", "both")

    assert (await ran(xml(tmp_path, '<executable cmd="echo loud"/>'))).lines == ["[echo-1] loud"]


async def test_output_is_told_to_handlers(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        one, RegisterEventHandler(OnProcessIO(
            target_action=one,
            on_stdout=lambda event: LogInfo(msg='heard ' + event.text.decode().strip()),
        )),
        """,
        before="one = ExecuteProcess(cmd=['sh', '-c', 'echo a; echo b >&2'])",
    )

    found = await ran(path)

    assert "heard a" in found.log
    assert found.lines == ["[sh-1] b"]


async def test_a_program_that_does_not_exist_counts_as_one_that_died(tmp_path: Path) -> None:
    found = await ran(xml(tmp_path, '<executable cmd="/no/such/program"/>'))

    assert any("[program-1] process has died: FileNotFoundError" in line for line in found.log)


async def test_a_process_that_is_respawned_comes_back(tmp_path: Path) -> None:
    path = xml(tmp_path, '<executable cmd="echo again" output="screen" respawn="true" respawn_delay="0.05"/>')

    found = await ran(path, until=lambda found: len(found.lines) >= 3)

    assert found.lines[:3] == ["[echo-1] again"] * 3


@pytest.mark.parametrize("more", ["pass", "signal.signal(signal.SIGTERM, signal.SIG_IGN)"])
async def test_a_process_that_ignores_signals_is_ended_by_the_next_stronger_one(tmp_path: Path, more: str) -> None:
    program = written(tmp_path, "stubborn.py", IGNORES.format(more=more))
    path = xml(
        tmp_path,
        f'<executable cmd="{sys.executable} {program}" output="screen" sigterm_timeout="0.1" sigkill_timeout="0.1"/>',
    )

    found = await ran(path, until=lambda found: found.lines != [])

    sent = [line for line in found.log if "sending" in line]
    assert len(sent) == (2 if more == "pass" else 3)
    assert "'SIGINT'" in sent[0] and "'SIGTERM'" in sent[1] and ("SIGKILL" in sent[-1]) == (more != "pass")


async def test_a_signal_can_be_sent_to_a_process(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        one, RegisterEventHandler(OnProcessIO(on_stdout=lambda event: EmitEvent(
            event=SignalProcess(signal_number=15, process_matcher=matches_action(one))))),
        """,
        before="one = ExecuteProcess(cmd=['sh', '-c', 'echo ready; sleep 60'])",
    )

    found = await ran(path)

    assert any(f"exit code {-signal.SIGTERM}" in line for line in found.log)


TELLS = "import sys; print(sys.stdout.isatty(), sys.stderr.isatty()); print('warned', file=sys.stderr)"


@pytest.mark.parametrize(
    ("option", "arguments", "terminal"),
    [("", {}, False), (", emulate_tty=True", {}, True), ("", {"emulate_tty": "true"}, True)],
)
async def test_a_process_has_a_terminal_where_that_is_asked_for_and_its_lines_are_the_same(
    tmp_path: Path, option: str, arguments: dict[str, str], terminal: bool
) -> None:
    program = written(tmp_path, "tells.py", TELLS)
    path = python(
        tmp_path,
        f"ExecuteProcess(cmd=['{sys.executable}', '{program}'], name='tells', output='screen'{option}), "
        "RegisterEventHandler(OnProcessIO(on_stdout=lambda event: LogInfo(msg=repr(event.text))))",
    )

    found = await ran(path, arguments=arguments)

    assert sorted(found.lines) == [f"[tells-1] {terminal} {terminal}", "[tells-1] warned"]
    assert f"b'{terminal} {terminal}\\n'" in found.log
    assert any("[tells-1] process has finished cleanly" in line for line in found.log)


async def test_the_command_of_a_process_is_told_where_that_is_asked_for(tmp_path: Path) -> None:
    found = await ran(python(tmp_path, "ExecuteProcess(cmd=['echo', 'a b'], log_cmd=True), ExecuteProcess(cmd=['ls'])"))

    assert [line for line in found.log if "command:" in line] == ["[echo-1] command: echo 'a b'"]


@pytest.mark.parametrize(
    "matcher", ["matches_pid(event.pid)", "matches_executable(event.cmd[0])", "matches_name('wait')"]
)
async def test_a_process_is_chosen_by_its_id_its_program_or_its_name(tmp_path: Path, matcher: str) -> None:
    path = python(
        tmp_path,
        f"""
        RegisterEventHandler(OnProcessIO(target_action=wait, on_stdout=lambda event: EmitEvent(
            event=SignalProcess(signal_number='9', process_matcher={matcher})))),
        RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: LogInfo(msg=f'end of {{event.process_name}}: {{event.returncode}}'))),
        wait, ExecuteProcess(cmd=['sleep', '0.01']),
        """,
        before="from launch.events.process import matches_executable, matches_name, matches_pid\n"
        "wait = ExecuteProcess(cmd=['sh', '-c', 'echo ready; exec sleep 60'], name='wait')",
    )

    found = await ran(path)

    assert {line for line in found.log if line.startswith("end of")} == {"end of wait-1: -9", "end of sleep-2: 0"}


async def test_what_a_process_leaves_behind_does_not_hold_up_its_end(tmp_path: Path) -> None:
    """It used to: a child that was started in the moment of the signal kept the output open, and the launch waited for it."""
    found = await ran(xml(tmp_path, '<executable cmd="sh -c \'sleep 60 &amp; echo $!\'" output="screen"/>'))

    assert any("has left others behind; sending signal 'SIGTERM' to them" in line for line in found.log)


async def test_a_daemon_that_keeps_the_output_is_left_alone_and_holds_up_nothing(tmp_path: Path) -> None:
    program = written(
        tmp_path,
        "start.py",
        """
        import subprocess
        print(subprocess.Popen(["sleep", "60"], start_new_session=True).pid, flush=True)
        """,
    )

    found = await ran(xml(tmp_path, f'<executable cmd="{sys.executable} {program}" output="screen"/>'))

    os.kill(int(found.lines[0].split()[-1]), signal.SIGKILL)  # raises if it had been ended, too


async def test_a_line_that_is_too_long_does_not_end_the_reading(tmp_path: Path) -> None:
    code = "import sys; sys.stdout.write('x' * 3_000_000 + chr(10)); print('after')"
    program = written(tmp_path, "long.py", code)

    found = await ran(xml(tmp_path, f'<executable cmd="{sys.executable} {program}" output="screen"/>'))

    assert "[python" in found.lines[0] and "(a line that is too long)" in found.lines[0]
    assert found.lines[-1].endswith("after")


async def test_a_program_of_a_package_is_started_with_its_arguments_for_ros(tmp_path: Path) -> None:
    program = written(tmp_path, "ws/driver/scripts/lidar", '#!/bin/sh\necho "$@"\n')
    os.chmod(program, 0o755)
    written(tmp_path, "ws/driver/package.xml", "<package><name>driver</name></package>")
    path = xml(
        tmp_path,
        '<node pkg="driver" exec="lidar" name="front" output="screen" args="--fast"><remap from="a" to="b"/></node>',
    )

    found = await ran(path, paths=[tmp_path / "ws"])

    assert found.lines == ["[lidar-1] --fast --ros-args -r __node:=front -r a:=b"]
