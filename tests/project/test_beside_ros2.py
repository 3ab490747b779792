"""What the documents say of ROS 2's own words, tools and platforms is so."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from actors import Node
from actors.actions.client import Goal
from actors.interfaces import encode, type_hash
from actors.interfaces.std_msgs.msg import String
from actors.topics.subscription import Subscription
from actors.transport.format.attachments import ATTACHMENT_SIZE
from actors.transport.format.keys import DataKey, write_key
from actors.transport.format.tokens import NodeToken, write_token
from actors.typing import Publisher
from cli.command import found
from robot import contracts
from tests.project.test_packaging import imported, imported_by
from tests.robot.nodes.test_contract_tables import contracts_of, described

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
OF_ONE_SYSTEM = {
    "fcntl", "termios", "tty", "pty", "resource", "pwd", "grp", "posix", "curses", "readline", "syslog", "crypt", "spwd", "nis", "msvcrt", "winreg",
}  # fmt: skip
"""Modules of the standard library that some systems lack."""


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def sources() -> list[Path]:
    return [path for folder in ("actors", "robot", "cli") for path in (ROOT / folder).rglob("*.py")]


def table(text: str, heading: str) -> list[list[str]]:
    """The cells of the first table behind a heading, row by row, without the line under its head."""
    _, found, rest = text.partition(f"\n{heading}\n")
    assert found, heading
    lines = re.search(r"(?:^\|.*\n)+", rest, re.MULTILINE)
    assert lines is not None
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[0].splitlines()]
    return [rows[0], *rows[2:]]


# -- patterns -----------------------------------------------------------------------------------------------------------------


def test_a_table_says_what_topics_services_and_actions_are_and_only_actions_can_be_canceled() -> None:
    head, *rows = table(page("concepts/topics-services-actions.md"), "## Topic, service or action")
    said = {row[0]: dict(zip(head[1:], row[1:], strict=True)) for row in rows}
    assert head[1:] == ["topic", "service", "action"]
    assert said["cancel"]["topic"] == "no"
    assert said["cancel"]["action"].startswith("yes")
    assert said["feedback"] == {"topic": "every message", "service": "none", "action": "while it runs"}
    assert said["in ROS"] == {
        "topic": "`/scan`, `/cmd_vel`",
        "service": "`/get_map`, `/set_mode`",
        "action": "`/navigate_to_pose`",
    }
    assert "docs/concepts/topics-services-actions.md" in README
    assert inspect.iscoroutinefunction(Goal.cancel)
    for kind in (Publisher, Subscription):
        assert not hasattr(kind, "cancel")
    answer: str = inspect.signature(Node.call).return_annotation
    assert answer.startswith("Coroutine[")  # awaited: there is no handle that could be canceled


def test_every_endpoint_of_the_robot_stands_under_its_pattern_with_a_reason() -> None:
    _, *rows = table(page("reference/robot.md"), "## Topic, service or action")
    listed = [(name, pattern) for pattern, _, names in rows for name in re.findall(r"`([^`]+)`", names)]
    assert len(dict(listed)) == len(listed)
    assert dict(listed) == {kind[1]: kind[0] for kind in map(described, contracts_of(contracts).values())}
    assert all(len(reason.split()) >= 5 for _, reason, _ in rows)


# -- tools --------------------------------------------------------------------------------------------------------------------


def test_a_command_that_exists_is_named_for_each_tool_of_rqt() -> None:
    replaced = dict(re.findall(r"`(?:robactor )?(\w+)` replaces\s+`(rqt_\w+)`", page("howto/web.md")))
    assert set(replaced.values()) == {"rqt_graph", "rqt_console", "rqt_plot", "rqt_reconfigure"}
    for command in replaced:
        assert found(command) is not None


def test_the_top_level_has_our_folders_and_no_workspace() -> None:
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("this is no clone")
    top = {line.partition("/")[0] for line in done.stdout.splitlines() if "/" in line}
    assert {folder for folder in top if not folder.startswith(".")} == {"actors", "robot", "cli", "tests", "docs"}
    definitions = {
        Path(line).suffix for line in done.stdout.splitlines() if "/interfaces/" in line and "/share/" in line
    }
    assert {".msg", ".srv", ".action"} <= definitions


def test_nothing_of_ros_2_is_imported_and_nothing_but_the_package_is_needed() -> None:
    assert {"pyproject.toml", "README.md"} <= {path.name for path in ROOT.iterdir()}
    of_ros = {
        name for name in imported("actors", "robot", "cli") if name.startswith(("rcl", "ros", "rmw", "ament", "rosidl"))
    }
    assert of_ros == set()
    check = "import sys, actors, robot, cli; print([name for name in sys.modules if name.startswith(('rclpy', 'rosidl', 'ament'))])"
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout == "[]\n"


@pytest.mark.slow(reason="installs the project into a new environment")
def test_it_is_installed_into_a_fresh_environment_and_runs(tmp_path: Path) -> None:
    """As the README's first command does it; needs the package index."""
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    installed = subprocess.run([python, "-m", "pip", "install", ROOT], capture_output=True, text=True, check=False)
    if "No matching distribution" in installed.stderr or "Connection" in installed.stderr:
        pytest.skip("there is no package index here")
    assert installed.returncode == 0, installed.stderr
    words = ("-m", "robot", "run", "--clock", "virtual", "--duration", "1", "--backend", "kinematic")
    ran = subprocess.run([python, *words], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr


# -- layers and platforms -----------------------------------------------------------------------------------------------------


def test_the_framework_imports_neither_the_robot_nor_the_command_line_and_the_robot_no_transport() -> None:
    for path in (ROOT / "actors").rglob("*.py"):
        names = imported_by(path)
        assert not names & {"robot", "cli", "tests"}, path
    for path in (ROOT / "robot" / "nodes").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "actors.transport" not in text and "import zenoh" not in text, path


def at_the_top(tree: ast.Module) -> Iterator[str]:
    """What a module imports whenever it is imported: not in functions, and not under an `if` or `try`."""
    for node in tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            yield node.module.partition(".")[0]


def test_no_module_needs_what_only_one_system_has_and_the_tested_platforms_are_said() -> None:
    named = re.compile(rf"\b({'|'.join(OF_ONE_SYSTEM)})\b")
    for path in sources():
        text = path.read_text(encoding="utf-8")
        needs = set(at_the_top(ast.parse(text))) & OF_ONE_SYSTEM if named.search(text) else set()
        assert needs == set(), path
    assert "tested on Linux (x86-64) with CPython 3.11, 3.12 and 3.13; macOS and Windows have not been tried" in README


def test_the_documents_say_which_wires_there_are_and_describe_that_of_zenoh() -> None:
    assert "rmw_zenoh_cpp" in README and "rmw_cyclonedds_cpp" in README and "docs/concepts/wire.md" in README
    _, *rows = table(page("concepts/wire.md"), "## The format")
    written = {what.partition(":")[0]: how for what, how in rows}
    key = DataKey(0, "/chatter", String.__ros_type__, type_hash(String))
    assert write_key(key) in written["a message's key"]
    assert encode(String(data="x"))[:4].hex(" ") in written["its payload"]
    assert f"{ATTACHMENT_SIZE} bytes" in written["its attachment"]
    node = NodeToken(0, "0" * 32, 3, "talker", "/")
    pattern = re.search(r"`(@ros2_lv/[^`]+)`", written["who is there"])
    assert pattern is not None
    assert pattern[1].replace("SESSION", "0" * 32).replace("NODE", "3") == write_token(node)


# -- figures ------------------------------------------------------------------------------------------------------------------


def test_the_readme_tells_the_jitter_of_a_control_loop_as_it_was_measured() -> None:
    (row,) = (
        line
        for line in page("reference/performance.md").splitlines()
        if line.startswith("| real-time control at 500 Hz")
    )
    measured = row.split("|")[2].partition(";")[0]
    told = " ".join(README.partition("**Hard real time.**")[2].partition("- **")[0].split())
    for figure in ("0.12 ms", "0.9 ms", "3.2 ms", "3 of 5,000 ticks"):
        assert figure in measured and figure in told, figure
    assert "C++" in told


def test_the_versions_that_are_needed_are_declared() -> None:
    assert 'requires-python = ">=3.11"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert "Python 3.11 or newer is all it takes" in README
