"""The README tells the truth: its example runs as printed, its test passes, its commands are those that exist."""

from __future__ import annotations

import os
import re
import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(marker: str) -> str:
    found = re.search(rf"<!-- {marker} -->\n```\w+\n(.*?)```", README, re.DOTALL)
    assert found is not None, f"the README has no block marked {marker!r}"
    return found[1]


def robactor(line: str) -> list[str]:
    """A command of the README, of the interpreter that runs the tests."""
    return [sys.executable, "-m", "robot", *shlex.split(line.partition("#")[0])[1:]]


def run(*command: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )


@pytest.mark.realtime
def test_the_example_is_heard_and_answers_in_another_terminal(tmp_path: Path) -> None:
    (tmp_path / "talker.py").write_text(block("example"), encoding="utf-8")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    own = {"ROBACTOR_GOSSIP_PORT": port, "RMW_IMPLEMENTATION": "", "PYTHONPATH": str(ROOT)}
    environment = {**os.environ, **own}
    talker = subprocess.Popen([sys.executable, "talker.py"], cwd=tmp_path, env=environment)
    try:
        commands = block("example commands").splitlines()
        echo, call = (
            subprocess.run(robactor(line), cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)
            for line in commands
        )
    finally:
        talker.send_signal(signal.SIGINT)
    assert re.fullmatch(r"data: hello at \d+\.\d s\n---\n", echo.stdout), echo.stderr
    assert "success=True, message='hello to you'" in call.stdout, call.stderr
    assert talker.wait(60) == 0


def test_the_example_has_at_most_20_lines() -> None:
    assert len([line for line in block("example").splitlines() if line.strip()]) <= 20


def test_the_test_example_passes_with_the_plugin(tmp_path: Path) -> None:
    (tmp_path / "talker.py").write_text(block("example"), encoding="utf-8")
    (tmp_path / "test_talker.py").write_text(block("test example"), encoding="utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\nasyncio_mode = auto\n", encoding="utf-8")
    plugin = () if _installed() else ("-p", "actors.testing.plugin")
    done = run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *plugin, cwd=tmp_path)
    assert "1 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("document", re.findall(r"\]\((docs/[\w./-]+|CHANGELOG\.md)\)", README))
def test_what_the_readme_links_to_exists(document: str) -> None:
    assert (ROOT / document).is_file()


@pytest.mark.parametrize("line", re.findall(r"^robactor (\w+)", block("robot commands"), re.MULTILINE))
def test_every_command_of_the_readme_has_help(line: str) -> None:
    done = run(sys.executable, "-m", "robot", line, "--help", cwd=ROOT)
    assert done.returncode == 0
    assert "usage" in done.stdout


def _installed() -> bool:
    from importlib.metadata import entry_points

    return any(entry.value == "actors.testing.plugin" for entry in entry_points(group="pytest11"))


def test_the_rig_needs_no_configuration_of_pytest(tmp_path: Path) -> None:
    """In a folder without any settings pytest-asyncio is strict; a test that uses `rig` is an asyncio test all the same."""
    (tmp_path / "talker.py").write_text(block("example"), encoding="utf-8")
    (tmp_path / "test_talker.py").write_text(block("test example"), encoding="utf-8")
    plugin = () if _installed() else ("-p", "actors.testing.plugin")
    done = run(
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:looptime_plugin",
        *plugin,
        cwd=tmp_path,
    )
    assert "1 passed" in done.stdout, done.stdout + done.stderr


def test_the_robots_commands_work_as_pasted_after_the_first_command(tmp_path: Path) -> None:
    """The environment of the first command is activated, and from then on `python` is its python."""
    activate, *commands = block("robot commands").splitlines()
    assert activate == ". .venv/bin/activate"
    assert all(line.startswith("robactor ") for line in commands)
    if not (Path(sys.prefix) / "bin" / "activate").exists():
        pytest.skip("these tests do not run in a virtual environment")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    done = run("sh", "-c", f"{activate}\nrobactor run --help\ncommand -v python", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == str(Path(sys.prefix) / "bin" / "python")


def test_the_readme_ends_with_what_it_does_not_do() -> None:
    *_, last = README.split("\n## ")
    assert last.startswith("What it does not do\n")
    for limit in ("web page", "cli.md", "launch.md", "ros2-network.md", "macOS"):
        assert limit in last, limit


def test_both_commands_say_what_they_do_while_they_install() -> None:
    assert "pip install -q" not in README
