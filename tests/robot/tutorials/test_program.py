"""Every tutorial as a program, and what docs/reference/tutorials.md says of them (C-34, E-06, E-08, X-14, X-22)."""

from __future__ import annotations

import importlib
import pkgutil
import re
import runpy
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from actors import Child, Node, Supervisor, check_node, check_tree, every, temporary
from actors.testing import Rig, scenario
from actors.testing.faults import ClockJump, Crash, Delay, SlowStart
from robot import tutorials
from robot.tutorials import humanoid_lab
from robot.tutorials.__main__ import main as list_or_run
from robot.tutorials.battery_service import BatteryClient, BatteryServer
from robot.tutorials.calibration import CalibrationClient, CalibrationService
from robot.tutorials.move_to_position import MoveClient, MoveServer
from robot.tutorials.program import Job, main, system
from tests.robot.stage import said
from tests.robot.tutorials.kit import alone

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "reference" / "tutorials.md").read_text(encoding="utf-8")
HELPERS = {"__main__", "executables", "program", "strides"}
MODULES = sorted({module.name for module in pkgutil.iter_modules(tutorials.__path__)} - HELPERS)


def tree_of(name: str) -> Callable[[], Supervisor]:
    make: Callable[[], Supervisor] = importlib.import_module(f"robot.tutorials.{name}").tree
    return make


def run_program(tree: Callable[[], Supervisor], *options: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(tree, options)
    assert isinstance(ended.value.code, int)
    return ended.value.code


@pytest.mark.parametrize("name", MODULES)
def test_every_tutorial_runs_as_a_program_and_ends_well(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program(tree_of(name), "--clock", "virtual", "--duration", "5") == 0
    printed = capsys.readouterr()
    assert "error" not in printed.out
    assert "[info" in printed.out  # whoever starts a program hears at least that it is ready
    assert printed.err == ""


@pytest.mark.parametrize("name", MODULES)
def test_the_file_of_every_tutorial_is_a_program(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [f"{name}.py", "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / "robot" / "tutorials" / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    assert "--clock" in capsys.readouterr().out


@pytest.mark.parametrize("name", MODULES)
def test_every_node_of_a_tutorial_says_what_it_is(name: str) -> None:
    nodes = [child.factory for child in tree_of(name)().children if isinstance(child, Child)]
    for node in nodes:
        assert isinstance(node, type) and issubclass(node, Node)
        assert not [finding for finding in check_node(node) if "docstring" in finding.what]
    errors = [finding for finding in check_tree(tree_of(name)()) if finding.level == "error"]
    clash = ["it takes /sensor_input as std_msgs/msg/String, but"] if name == "physical_ai" else []
    assert len(errors) == len(clash)
    assert all(finding.what.startswith(text) for finding, text in zip(errors, clash, strict=True))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_a_program_quietly(number: signal.Signals) -> None:
    process = subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "robot.tutorials.physical_ai"],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert any("sensor_input" in line for line in process.stdout)  # it runs: the clash of types has been reported
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert "Interrupted, shutting down" in out


def test_a_job_that_fails_is_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    def failing() -> Supervisor:
        """A client of a sensor that is not there."""
        client = Child(CalibrationClient, restart=temporary, significant=True, parameters={"sensor_name": "camera_9"})
        return system("failing", CalibrationService, client)

    assert run_program(failing) == 1
    assert "ERROR: Failed to calibrate camera_9" in capsys.readouterr().out


class Broken(Node):
    """Fails ten times a second."""

    @every(hz=10)
    def fail(self) -> None:
        raise OSError("no bus")


def broken() -> Supervisor:
    """A node that fails."""
    return system("broken", Broken)


def test_a_supervisor_that_gives_up_is_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program(broken, "--clock", "virtual", "--duration", "60") == 3
    assert "gave up" in capsys.readouterr().err


def test_what_is_not_understood_is_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program(broken, "--clock", "virtual") == 2  # it would go on for ever, and fast
    assert "needs a --duration" in capsys.readouterr().err
    assert run_program(broken, "--log-level", "loud") == 2
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("talker_listner",), "robot.tutorials: there is no tutorial 'talker_listner'; did you mean talker_listener?"),
        (("xyzzy",), "robot.tutorials: there is no tutorial 'xyzzy'; python -m robot.tutorials lists all of them"),
        (("program",), "robot.tutorials: there is no tutorial 'program'; python -m robot.tutorials lists all of them"),
        (("ring", "--duration", "-1"), "argument --duration: -1 is not a positive number of seconds"),
        (("ring", "--duration", "nan"), "argument --duration: nan is not a positive number of seconds"),
        (("ring", "--log-level", "verbose"), "argument --log-level: invalid choice: 'verbose'"),
        (("ring", "--durtion", "3"), "unrecognized arguments: --durtion 3; did you mean --duration?"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(words: tuple[str, ...], complaint: str) -> None:
    command = [sys.executable, "-m", "robot.tutorials", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert complaint in line


def test_a_tutorial_called_as_a_module_calls_itself_so() -> None:
    command = [sys.executable, "-m", "robot.tutorials.ring", "--duration", "0"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr == (
        "robot.tutorials.ring: argument --duration: 0 is not a positive number of seconds "
        "(see python -m robot.tutorials.ring --help)\n"
    )


def test_the_list_of_tutorials_has_each_with_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert list_or_run([]) == 0
    rows = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[0] for row in rows] == MODULES
    assert ["talker_listener", "A talker and a listener: every robot's first topic."] in rows
    assert all(len(row) == 2 for row in rows)


def test_levels_are_taken_in_any_case(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_program(humanoid_lab.tree, "--clock", "virtual", "--duration", "1", "--log-level", "DEBUG") == 0
    assert "Received sensor data" in capsys.readouterr().out


def test_a_tutorial_is_run_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        list_or_run(["talker_listener", "--clock", "virtual", "--duration", "1.5"])
    assert ended.value.code == 0
    assert "Received: Hello World 0" in capsys.readouterr().out


@pytest.mark.parametrize("document", ["README.md", "CHANGELOG.md", "docs/reference/tutorials.md"])
def test_documents_count_the_tutorials_of_the_folder(document: str) -> None:
    counts = re.findall(
        r"(\d+) (?:small )?systems of(?: the)? ROS 2 tutorials", (ROOT / document).read_text(encoding="utf-8")
    )
    assert counts == [str(len(MODULES))]


def test_debug_lines_are_shown_when_they_are_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    for level, shown in (("info", False), ("debug", True)):
        run_program(humanoid_lab.tree, "--clock", "virtual", "--duration", "1", "--log-level", level)
        assert ("Received sensor data" in capsys.readouterr().out) is shown


class Aimless(Job):
    """A job without a job."""


async def test_a_job_needs_a_job(rig: Rig) -> None:
    with rig.expect_failure(NotImplementedError, match="Aimless has no job"):
        await rig.start(Child(Aimless, restart=temporary))
        await rig.advance(1.0)
    assert said(rig, "aimless") == []


FAULTS = [Crash("*_server"), SlowStart(), ClockJump(), Delay()]


async def _ends(rig: Rig, server: type[Node], client: type[Job]) -> None:
    """However it goes, the client says how it went, and ends."""
    await rig.start(server, alone(client))
    await rig.advance(60.0)
    assert rig.state(client).state == "stopped"
    assert said(rig, client.node_name)


@scenario(seeds=30, faults=FAULTS)
async def test_however_it_goes_the_battery_client_ends(rig: Rig) -> None:
    await _ends(rig, BatteryServer, BatteryClient)


@scenario(seeds=30, faults=FAULTS)
async def test_however_it_goes_the_move_client_ends(rig: Rig) -> None:
    await _ends(rig, MoveServer, MoveClient)


# -- the page ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODULES)
def test_the_page_has_a_row_for_every_tutorial_with_its_nodes(name: str) -> None:
    row = next((line for line in PAGE.splitlines() if line.startswith(f"| `{name}` |")), None)
    assert row is not None, f"docs/reference/tutorials.md has no row for {name}"
    if name not in ("ring", "spot_by_voice"):  # two hundred, and those of other rows
        nodes = re.findall(r"`(\w+)`", row.split("|")[2])
        assert set(nodes) >= {child.name for child in tree_of(name)().children}


def test_the_page_explains_every_node_of_the_lab() -> None:
    section = PAGE.split("## The lab of three nodes")[1].split("\n## ")[0]
    for node in humanoid_lab.tree().children:
        assert f"`{node.name}`" in section
    for part in ("Data flow", "Why topics, and why a service", "How to extend it", "/sensor/data", "plan_trajectory"):
        assert part in section
