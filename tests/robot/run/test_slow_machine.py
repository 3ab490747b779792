"""`python -m robot run` on a part of a core, and after a stop, as by Ctrl-Z and fg: it walks on, and hears who ends it. `pytest -m realtime`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import IO

import pytest

from tests.figures.load import family, processor_seconds
from tests.robot.run.test_run import ENVIRONMENT, ROOT

PERIOD = 0.1
"""Seconds in which a program has its share of a core, as in a control group."""
MODES = {"physics": (), "kinematic": ("--backend", "kinematic"), "processes": ("--processes",)}

pytestmark = [pytest.mark.realtime, pytest.mark.skipif(sys.platform != "linux", reason="/proc is read")]


class Running:
    """One run of the robot, in a process group of its own, and what it says."""

    def __init__(self, tmp_path: Path, *words: str) -> None:
        self._report = tmp_path / "report.json"
        self.process = subprocess.Popen(
            [sys.executable, "-m", "robot", "run", "--no-web", "--report", str(self._report), *words],
            cwd=ROOT, env=ENVIRONMENT | {"ROBACTOR_REALTIME": "0"}, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        assert self.process.stderr is not None
        self.lines: list[str] = []
        self._reader = Thread(target=self._read, args=(self.process.stderr,))
        self._reader.start()

    def _read(self, stderr: IO[str]) -> None:
        self.lines.extend(iter(stderr.readline, ""))

    def wait_for(self, text: str, seconds: float = 120.0) -> None:
        end = time.monotonic() + seconds
        while not any(text in line for line in self.lines):
            assert time.monotonic() < end, self.lines
            assert self.process.poll() is None, self.lines
            time.sleep(0.002)

    def signal(self, number: signal.Signals) -> None:
        os.killpg(self.process.pid, number)

    def processor(self) -> float:
        return processor_seconds(family(self.process.pid))

    def report(self) -> dict[str, object]:
        self._reader.join()
        found: dict[str, object] = json.loads(self._report.read_text(encoding="utf-8"))
        return found


@contextmanager
def running(tmp_path: Path, *words: str) -> Iterator[Running]:
    one = Running(tmp_path, *words)
    try:
        yield one
    finally:
        if one.process.poll() is None:
            one.signal(signal.SIGCONT)
            one.signal(signal.SIGKILL)
        one.process.wait()
        one._reader.join()
        assert one.process.stderr is not None
        one.process.stderr.close()


@contextmanager
def on_a_share(one: Running, share: float) -> Iterator[None]:
    """Let the run have so much of a core: it is stopped for the rest of each period."""
    over = Event()

    def cycle() -> None:
        with suppress(ProcessLookupError):  # it has ended meanwhile
            while not over.wait(share * PERIOD) and one.process.poll() is None:
                one.signal(signal.SIGSTOP)
                time.sleep((1.0 - share) * PERIOD)
                one.signal(signal.SIGCONT)

    thread = Thread(target=cycle)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("mode", ["physics", "kinematic"])
def test_on_a_part_of_a_core_it_walks_on_slowly_and_ends_in_order(tmp_path: Path, mode: str, share: float) -> None:
    with running(tmp_path, *MODES[mode]) as one:
        one.wait_for("robot running")
        with on_a_share(one, share):
            time.sleep(60.0)
            ran = one.processor()
            one.process.send_signal(signal.SIGINT)
            one.wait_for("stopping")
            assert one.processor() - ran < 1.0
            assert one.process.wait(timeout=180.0) == 130
        report = one.report()
        assert report["falls"] == 0
        assert report["last"]["body_height"] < 0.25  # type: ignore[index]
        assert any("of real time" in line for line in one.lines) or report["simulated_seconds"] > 40.0  # type: ignore[operator]
        assert not [line for line in one.lines if "blocked the event loop" in line or "sitting down [/gait]" in line]


@pytest.mark.parametrize(
    "seconds",
    [1.0, 10.0, pytest.param(60.0, marks=pytest.mark.slow(reason="a minute of standing still"))],
    ids=lambda seconds: f"{seconds:g} s",
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("mode", MODES)
def test_after_a_stop_it_walks_on_and_hears_who_ends_it(
    tmp_path: Path, mode: str, number: signal.Signals, seconds: float
) -> None:
    with running(tmp_path, *MODES[mode]) as one:
        one.wait_for("Robot is now standing")
        time.sleep(2.0)
        one.signal(signal.SIGSTOP)
        time.sleep(seconds)
        one.signal(signal.SIGCONT)
        one.wait_for("the robot stood still for", 10.0)
        time.sleep(2.0)
        ran = one.processor()
        one.process.send_signal(number)
        one.wait_for("stopping")
        assert one.processor() - ran < 1.0
        assert one.process.wait(timeout=30.0) == 128 + number
        report = one.report()
        assert report["falls"] == 0
        assert report["last"]["body_height"] < 0.25  # type: ignore[index]
        assert not [line for line in one.lines if "safety stop" in line or "blocked the event loop" in line]


def test_a_duration_is_of_real_time_after_a_stop_too(tmp_path: Path) -> None:
    with running(tmp_path, "--duration", "12", *MODES["kinematic"]) as one:
        one.wait_for("Robot is now standing")
        one.signal(signal.SIGSTOP)
        time.sleep(15.0)
        one.signal(signal.SIGCONT)
        assert one.process.wait(timeout=10.0) in (0, 1)
        assert one.report()["falls"] == 0
