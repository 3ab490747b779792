"""Signals at any instant from the start of a run to its end: the robot sits, the exit code tells the signal, and nothing is left."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest

from robot.link.segment import PREFIX
from tests.figures.load import family

ROOT = Path(__file__).parents[3]
SHM = Path("/dev/shm")
INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc"),
]


class Ended(NamedTuple):
    """A run that has ended, and what it has left."""

    code: int
    said: str
    processes: list[str]
    segments: list[str]
    seconds: float
    """From the signal to the end."""


class Run:
    """A run of the robot in a process group of its own."""

    def __init__(self, *words: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "robot", "run", *words],
            cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        self._said: list[str] = []

    def until(self, text: str) -> None:
        """Wait until it has said this."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._said.append(line)
            if text in line:
                return
        raise AssertionError("".join(self._said))

    def ends(self, *numbers: signal.Signals, group: bool = True, apart: float = 0.01) -> Ended:
        """Send signals, to the whole group as `timeout`, terminals and service managers do, and wait for the end of all processes."""
        pid, begun = self.process.pid, time.monotonic()
        for number in numbers:
            if self.process.poll() is None:
                (os.killpg if group else os.kill)(pid, number)
                time.sleep(apart)
        assert self.process.stdout is not None
        with self.process:
            said = "".join([*self._said, self.process.stdout.read()])
            code = self.process.wait(120)
        seconds = time.monotonic() - begun
        deadline = time.monotonic() + 5.0
        while (left := _group(pid)) and time.monotonic() < deadline:
            time.sleep(0.05)
        return Ended(code, said, left, [path.name for path in SHM.glob(f"{PREFIX}{pid}-*")], seconds)


def _group(leader: int) -> list[str]:
    """The command lines of the processes of a group that run."""
    found: list[str] = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                state, _, group = (folder / "stat").read_text().rpartition(")")[2].split()[:3]
                line = (folder / "cmdline").read_text().replace("\0", " ")
            except OSError:  # it has ended
                continue
            if int(group) == leader and state != "Z":
                found.append(line)
    return found


def leaves_nothing(ended: Ended) -> None:
    assert "Traceback" not in ended.said and "resource_tracker" not in ended.said, ended.said
    assert (ended.processes, ended.segments) == ([], [])


@pytest.mark.parametrize("processes", [False, True], ids=["one process", "processes"])
@pytest.mark.parametrize(
    "numbers", [(INT, INT), (TERM, TERM), (HUP,), (INT, TERM)], ids=lambda each: "+".join(n.name for n in each)
)
def test_a_walking_robot_sits_before_its_program_ends(
    numbers: tuple[signal.Signals, ...], processes: bool, tmp_path: Path
) -> None:
    file = tmp_path / "report.json"
    run = Run("--report", str(file), *(["--processes"] if processes else []))
    run.until("gait=walk")
    ended = run.ends(*numbers)
    leaves_nothing(ended)
    assert ended.code == 128 + numbers[0]
    assert json.loads(file.read_text(encoding="utf-8"))["last"]["body_height"] < 0.22


def test_a_second_signal_after_half_a_second_does_not_wait_for_the_robot_to_sit() -> None:
    run = Run()
    run.until("gait=walk")
    ended = run.ends(INT, INT, apart=0.6)
    assert (ended.code, ended.processes, ended.segments) == (130, [], [])
    assert "it was killed" in ended.said


@pytest.mark.parametrize("processes", [False, True], ids=["one process", "processes"])
def test_a_reader_that_goes_makes_the_robot_sit(processes: bool, tmp_path: Path) -> None:
    file = tmp_path / "report.json"
    run = Run("--report", str(file), *(["--processes"] if processes else []))
    run.until("gait=walk")
    assert run.process.stdout is not None
    run.process.stdout.close()
    assert run.process.wait(60) == 141
    assert json.loads(file.read_text(encoding="utf-8"))["last"]["body_height"] < 0.22
    assert _group(run.process.pid) == []


def test_the_duration_counts_from_when_the_robot_runs() -> None:
    begun = time.monotonic()
    run = Run("--processes", "--duration", "3")
    run.until("robot running")
    started = time.monotonic()
    run.until("stopping: braking")
    assert started - begun > 0.5, "a start takes a while"
    assert time.monotonic() - started > 2.5
    assert run.ends().code == 0


def test_a_body_that_is_gone_is_in_the_report(tmp_path: Path) -> None:
    file = tmp_path / "report.json"
    run = Run("--processes", "--report", str(file))
    run.until("robot running")
    (body,) = (pid for pid in family(run.process.pid) if Path(f"/proc/{pid}/comm").read_text() == "body\n")
    os.kill(body, signal.SIGKILL)
    ended = run.ends()
    assert (ended.code, ended.processes, ended.segments) == (3, [], [])
    report = json.loads(file.read_text(encoding="utf-8"))
    assert (report["last"], "there is no robot any more" in report["failure"]) == (None, True)


INSTANTS = 4
MORE = 20
KINDS = [(INT,), (TERM, TERM), (HUP,), (INT, TERM)]


@pytest.mark.parametrize("processes", [False, True], ids=["one process", "processes"])
@pytest.mark.parametrize(
    "number",
    [
        pytest.param(number, marks=[] if number < INSTANTS else [pytest.mark.slow(reason="more instants")])
        for number in range(MORE)
    ],
)
def test_a_signal_at_any_instant_ends_the_program_and_leaves_nothing(number: int, processes: bool) -> None:
    numbers = KINDS[number % len(KINDS)]
    at = random.Random(f"{number} {processes}").uniform(0.15, 10.0 if processes else 6.0)
    run = Run("--duration", "3", *(["--processes"] if processes else []))
    time.sleep(at)
    ended = run.ends(*numbers)
    assert ended.code in {0, *(128 + number for number in numbers)}
    if "init_import_site" not in ended.said:  # before the first line of the program it is Python's
        leaves_nothing(ended)
