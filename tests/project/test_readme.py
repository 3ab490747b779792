"""The README tells the truth: its example runs as printed, its test passes, its commands are those that exist."""

from __future__ import annotations

import re
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


def run(*command: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )


def test_the_example_prints_what_it_hears_and_the_sum(tmp_path: Path) -> None:
    (tmp_path / "demo.py").write_text(block("example"), encoding="utf-8")
    done = run(sys.executable, "demo.py", cwd=tmp_path)
    assert done.stderr == ""
    assert re.fullmatch(r"hello at \d+\.\d s\n5\n", done.stdout)


def test_the_example_has_at_most_26_lines() -> None:
    assert len([line for line in block("example").splitlines() if line.strip()]) <= 26


def test_the_test_example_passes_with_the_plugin(tmp_path: Path) -> None:
    (tmp_path / "demo.py").write_text(block("example"), encoding="utf-8")
    (tmp_path / "test_demo.py").write_text("from demo import *\n\n" + block("test example"), encoding="utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\nasyncio_mode = auto\n", encoding="utf-8")
    plugin = () if _installed() else ("-p", "actors.testing.plugin")
    done = run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *plugin, cwd=tmp_path)
    assert "1 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("document", re.findall(r"\]\((docs/[\w./-]+|CHANGELOG\.md)\)", README))
def test_what_the_readme_links_to_exists(document: str) -> None:
    assert (ROOT / document).is_file()


@pytest.mark.parametrize("line", re.findall(r"^python -m robot (\w+)", README, re.MULTILINE))
def test_every_command_of_the_readme_has_help(line: str) -> None:
    done = run(sys.executable, "-m", "robot", line, "--help", cwd=ROOT)
    assert done.returncode == 0
    assert "usage" in done.stdout


def _installed() -> bool:
    from importlib.metadata import entry_points

    return any(entry.value == "actors.testing.plugin" for entry in entry_points(group="pytest11"))


def test_the_rig_needs_no_configuration_of_pytest(tmp_path: Path) -> None:
    """In a folder without any settings pytest-asyncio is strict; a test that uses `rig` is an asyncio test all the same."""
    (tmp_path / "demo.py").write_text(block("example"), encoding="utf-8")
    (tmp_path / "test_demo.py").write_text("from demo import *\n\n" + block("test example"), encoding="utf-8")
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
    assert all(line.startswith("python -m robot ") for line in commands)
    if not (Path(sys.prefix) / "bin" / "activate").exists():
        pytest.skip("these tests do not run in a virtual environment")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    done = run("sh", "-c", f"{activate}\npython -m robot run --help\ncommand -v python", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == str(Path(sys.prefix) / "bin" / "python")


@pytest.mark.parametrize("document", ["README.md", "docs/start/from-rclpy.md"])
def test_what_it_does_not_do_yet_is_said_before_anything_is_shown(document: str) -> None:
    text = (ROOT / document).read_text(encoding="utf-8")
    before, _, after = text.partition("**What it does not do yet.**")
    box = " ".join(after.partition("\n\n")[0].replace("\n> ", " ").split())
    assert "```" not in before and "| ROS 2" not in before
    for limit in ("web page", "cli.md", "launch.md", "wire.md"):
        assert limit in box or limit.capitalize() in box, limit


def test_both_commands_say_what_they_do_while_they_install() -> None:
    assert "pip install -q" not in README
