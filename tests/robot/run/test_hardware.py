"""`python -m robot run --hardware unitree`, from its words to its exit code."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

import pytest

from robot.hardware.body import Sample
from robot.hardware.unitree import Go2
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


@contextmanager
def bench_of(domain: int) -> Iterator[tuple[IO[str], list[str]]]:
    """What a simulated Go2 in another process prints once a second, and the words that a run needs for it."""
    module = "tests.robot.hardware.go2"
    bench = subprocess.Popen([sys.executable, "-m", module, "--domain", str(domain)], stdout=subprocess.PIPE, text=True)
    try:
        assert bench.stdout is not None
        bench.stdout.readline()
        yield bench.stdout, ["--hardware", "unitree", "--interface", "lo", "--domain", str(domain), "--no-web"]
    finally:
        bench.kill()
        bench.communicate()


def test_its_motors_are_off_until_they_are_enabled(capfd: pytest.CaptureFixture[str]) -> None:
    with bench_of(203) as (printed, words):
        words += ["--duration", "1"]
        assert main(words) == 0
        off = capfd.readouterr().err
        assert OFF in off and "walking service" not in off
        assert " 0 commands" in printed.readline()
        assert main([*words, "--enable"]) == 0
        on = capfd.readouterr().err
        assert ON in on and "'normal' is switched off" in on and "'normal' is switched on again" in on


def test_a_fault_that_restarts_do_not_mend_ends_the_run_with_one_line_that_names_it(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def faulty(driver: Go2) -> Sample | None:
        raise ZeroDivisionError("a fault of its driver")

    monkeypatch.setattr(Go2, "next_sample", faulty)
    with bench_of(204) as (_, words):
        assert main(words) == 3
    last = capfd.readouterr().err.splitlines()[-1]
    assert last.startswith("robot run: ") and "proprioception" in last and "a fault of its driver" in last
