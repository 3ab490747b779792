"""`python -m robot run --hardware unitree`, from its words to its exit code."""

from __future__ import annotations

import subprocess
import sys

import pytest

from robot.run.command import main
from robot.run.hardware import OFF, ON

pytest.importorskip("cyclonedds")
pytest.importorskip("mujoco")


def test_where_no_robot_is_one_line_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["--hardware", "unitree", "--interface", "lo", "--domain", "201", "--no-web"]) == 3
    assert capfd.readouterr().err == (
        "robot run: no Go2 is heard in domain 201 (rt/lowstate): is it switched on, and --interface its network?\n"
    )


def test_without_dds_one_line_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['cyclonedds.internal'] = None; from robot.run.command import main; "
        "sys.exit(main(['--hardware', 'unitree', '--domain', '202', '--no-web']))"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.startswith("robot run: --hardware unitree: ") and "robactor[dds]" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_its_motors_are_off_until_they_are_enabled(capfd: pytest.CaptureFixture[str]) -> None:
    bench = subprocess.Popen(
        [sys.executable, "-m", "tests.robot.hardware.go2", "--domain", "203"], stdout=subprocess.PIPE, text=True
    )
    words = ["--hardware", "unitree", "--interface", "lo", "--domain", "203", "--no-web", "--duration", "1"]
    try:
        assert bench.stdout is not None
        bench.stdout.readline()
        assert main(words) == 0
        off = capfd.readouterr().err
        assert OFF in off and "walking service" not in off
        assert " 0 commands" in bench.stdout.readline()
        assert main([*words, "--enable"]) == 0
        on = capfd.readouterr().err
        assert ON in on and "'normal' is switched off" in on and "'normal' is switched on again" in on
    finally:
        bench.kill()
        bench.communicate()
