"""The program `robactor` where another project has a package `robot` too, as Robot Framework has: one sentence, with the remedy.

What Robot Framework does is imitated: its `robot/__init__.py` imports from its module `robot.run`, and its commands import from `robot`.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import robot
from tests.facts import lacks

ROBOT_PACKAGE = Path(robot.__file__).parent
START = "from cli.entry import console; console()"
INSTALLED_OVER = (
    "Robot Framework was installed over the robot, and both are a package robot: install each in an environment of its own, or "
    "pip uninstall robotframework, then pip install --force-reinstall --no-deps robactor\n"
)


def run(path: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *command],
        env={"PYTHONPATH": f"{path}:{ROBOT_PACKAGE.parent}"},
        cwd=path,
        capture_output=True,
        text=True,
        timeout=60,
    )


@pytest.fixture
def framework(tmp_path: Path) -> Path:
    """A folder where Robot Framework was installed after robactor: our folder `robot`, and its `__init__.py`."""
    (tmp_path / "robot").mkdir()
    for name in ("__main__.py", "assembly.py"):
        shutil.copy(ROBOT_PACKAGE / name, tmp_path / "robot")
    shutil.copytree(ROBOT_PACKAGE / "run", tmp_path / "robot" / "run")
    (tmp_path / "robot" / "__init__.py").write_text(
        "from robot.run import RobotFramework\n__all__ = ['run']\n", encoding="utf-8"
    )
    return tmp_path


def test_robot_framework_installed_over_the_robot_is_one_sentence_of_python_m_robot(framework: Path) -> None:
    done = run(framework, "-m", "robot", "run")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"robot: {INSTALLED_OVER}")


def test_robot_framework_installed_over_the_robot_is_one_sentence_of_the_program(framework: Path) -> None:
    done = run(framework, "-c", START, "topic", "list")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"robactor: {INSTALLED_OVER}")


def test_robot_framework_installed_over_the_robot_is_what_an_import_fails_with(framework: Path) -> None:
    done = run(framework, "-c", "from robot import Robot")
    assert done.returncode == 1
    assert done.stderr.endswith(f"\nImportError: {INSTALLED_OVER}")


def test_a_package_robot_that_hides_the_robots_is_named(tmp_path: Path) -> None:
    (tmp_path / "robot.py").write_text("__all__ = ['Robot']\n", encoding="utf-8")
    done = run(tmp_path, "-c", START, "--version")
    assert (done.returncode, done.stdout) == (1, "")
    assert lacks(done.stderr, f"robactor robot {tmp_path}/robot.py environment rename") == []


def test_with_the_robots_own_package_the_program_does_what_it_is_told(tmp_path: Path) -> None:
    done = run(tmp_path, "-c", START, "--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: robactor COMMAND")


@pytest.mark.parametrize("name", ["run_cli", "rebot_cli"])
def test_the_commands_of_robot_framework_say_that_the_robot_was_installed_over_it(name: str) -> None:
    with pytest.raises(
        ImportError, match=r"robactor was installed over Robot Framework, .* pip uninstall robactor, then pip install"
    ):
        exec(f"from robot import {name}")
    assert not hasattr(robot, "run_tests")
