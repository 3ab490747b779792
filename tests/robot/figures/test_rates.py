"""What `tests.figures rates` and `tests.figures odometry` say of a robot, and of how it was measured."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robot.assembly import Robot
from robot.run.tree_nodes import nodes_of
from tests.figures import odometry, rates
from tests.figures.__main__ import main
from tests.figures.fidelity import IDEAL
from tests.figures.levels import measure
from tests.figures.load import busy, family, processor_seconds
from tests.figures.rates_run import Punctuality, Run, at_rate, punctuality
from tests.figures.rates_start import start_robot

ROOT = Path(__file__).parents[3]


def evaluate(*words: str) -> tuple[subprocess.CompletedProcess[str], dict[str, Any]]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "tests.figures", *words, "--json"],
        cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300.0,
    )  # fmt: skip
    return done, json.loads(done.stdout)


def test_a_punctual_loop_has_no_error() -> None:
    found = punctuality([5.0 + 0.005 * k for k in range(1000)], 200.0)
    assert found.rate == pytest.approx(200.0)
    assert (found.p50, found.p99) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert found.missed == 0.0


def test_steps_that_never_came_are_missed_and_those_behind_them_are_on_time() -> None:
    found = punctuality([0.005 * k for k in range(2000) if k not in (500, 501, 1200)], 200.0)
    assert found.missed == pytest.approx(0.15, abs=0.001)


def test_steps_that_come_late_together_are_missed_until_they_have_caught_up() -> None:
    times = [0.005 * k for k in range(1000)]
    times[500:504] = [times[503] + 0.0001 * k for k in range(4)]  # held up for 15 ms, then done one after another
    found = punctuality(times, 200.0)
    assert found.rate == pytest.approx(200.0)
    assert found.missed == pytest.approx(0.3)  # they came 15, 10.1 and 5.2 ms late; the fourth was in time
    assert found.p50 == pytest.approx(0.0, abs=1e-6)


def test_a_steady_jitter_is_told_by_its_quantiles() -> None:
    jitter = np.random.default_rng(1).normal(0.0, 0.0002, 20000)
    found = punctuality((np.arange(20000) * 0.005 + jitter).tolist(), 200.0)
    assert found.p50 == pytest.approx(1e3 * 0.0002 * np.sqrt(2.0) * 0.6745, rel=0.05)
    assert found.p99 == pytest.approx(1e3 * 0.0002 * np.sqrt(2.0) * 2.576, rel=0.05)


def test_a_loop_that_did_not_run_is_not_punctual() -> None:
    assert punctuality([], 200.0).missed == 100.0


def test_every_row_of_the_rates_is_measured() -> None:
    names = [metric.name for metric in rates.metrics("kinematic", 1.0)]
    assert {name[:5] for name in names if name.startswith("RT-")} == {f"RT-0{number}" for number in range(1, 8)}
    assert len(set(names)) == len(names)


def test_the_robot_in_processes_has_the_lines_of_the_robot_in_one_and_with_loops_both_have_them_again() -> None:
    names = {metric.name for metric in rates.metrics("physics", 1.0, (0, 1, 2))}
    split = {name for name in names if name.endswith(", split")}
    assert {name.removesuffix(", split") for name in split} <= names
    assert len([name for name in split if name.startswith("control at 200 Hz")]) == 3
    assert {name for name in split if "falls" in name} == {
        "falls, split",
        "1 endless loop beside: falls, split",
        "2 endless loops beside: falls, split",
    }
    assert not [name for name in rates.metrics("kinematic", 1.0) if name.name.endswith("split")]


def test_a_start_is_measured_from_the_command_until_the_robot_runs() -> None:
    found = start_robot(1, "--backend", "kinematic", "--no-web")
    assert found.wall > 0.1
    assert found.processor > 0.1
    with pytest.raises(RuntimeError, match="did not start"):
        start_robot(1, "--backend", "none")


def test_one_process_and_several_stand_side_by_side() -> None:
    rows = [
        {"name": "falls", "unit": "", "median": 3.0},
        {"name": "falls, split", "unit": "", "median": 0.0},
        {"name": "of one alone", "unit": "ms", "median": 1.0},
    ]
    head, line = rates.side_by_side({"metrics": rows}).splitlines()
    assert head.split() == ["one", "process", "split"]
    assert line.split() == ["falls", "3", "0"]
    assert rates.side_by_side({"metrics": rows[2:]}) == ""


def test_without_a_run_that_is_alone_and_at_another_rate_only_one_process_and_several_are_compared() -> None:
    beside = [metric.name for metric in rates.metrics("physics", 1.0, (1, 2))]
    assert all("endless loop" in name for name in beside)
    fast = [metric.name for metric in rates.metrics("physics", 1.0, (0,), 500.0)]
    assert {"control at 500 Hz, period error p99", "control at 500 Hz, period error p99, split"} <= set(fast)
    assert not [name for name in fast if name.startswith("RT-")]


def test_the_share_of_each_process_is_told_and_falls_are_counted_over_all_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    def one(backend: str, seed: int, duration: float, busy: int, rate: float) -> Run:
        assert (backend, duration, rate) == ("physics", 60.0, 500.0)
        return Run({}, Punctuality(rate, 0.1, 0.2, 0.0), 30.0, 40.0, 25.0, falls=seed % 2)

    def split(seed: int, duration: float, busy: int, rate: float, *, fifo: bool) -> Run:
        return Run({}, Punctuality(rate, 0.1, 0.2, 0.0), 45.0, 50.0, 42.0, shares={"control": 15.0 if fifo else 16.0})

    monkeypatch.setattr(rates, "run_robot", one)
    monkeypatch.setattr(rates, "run_split", split)
    found = measure(rates.metrics("physics", 60.0, (1,), 500.0, fifo=False), (1, 2, 3), backend="physics")
    by_name = {row["name"]: row["median"] for row in found["metrics"]}
    assert by_name["1 endless loop beside: share of one core, nobody listening, process: control"] == 16.0
    assert by_name["1 endless loop beside: share of one core, nobody listening, process: body"] == 0.0
    alone = [by_name[f"1 endless loop beside: share of one core, nobody listening{where}"] for where in ("", ", split")]
    assert alone == [25.0, 42.0]
    counted = next(line for line in rates.side_by_side(found).splitlines() if "in all of 3 runs" in line)
    assert counted.split()[-2:] == ["2", "0"]


def test_another_rate_reaches_the_driver_that_paces_the_control_loop() -> None:
    whole = Robot("empty", body="kinematic").tree
    found = {child.name: child.parameters.get("rate") for child in nodes_of(at_rate(whole, 500.0))}
    assert found["proprioception"] == 500.0
    assert [name for name, rate in found.items() if rate == 500.0] == ["proprioception"]


@pytest.mark.parametrize(
    "words", [["--rate", "50"], ["--rate", "500", "--backend", "kinematic"], ["--loops", "1", "--backend", "kinematic"]]
)
def test_what_cannot_be_compared_is_refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rates", *words]) == 2
    assert "--rate" in capsys.readouterr().err


def test_endless_loops_run_beside_on_one_processor_and_end_with_the_measurement() -> None:
    allowed, before = os.sched_getaffinity(0), family(os.getpid())
    with busy(2) as strangers:
        assert len(strangers) == 2
        assert family(os.getpid()) - before == strangers  # by which they do not count as the robot's
        assert os.sched_getaffinity(0) == {min(allowed)}
        for one in strangers:
            assert os.sched_getaffinity(one) == {min(allowed)}
        used, limit = processor_seconds(strangers), time.monotonic() + 30.0
        while processor_seconds(strangers) < used + 0.1:
            assert time.monotonic() < limit, "the loops do not run"
            os.sched_yield()
    assert os.sched_getaffinity(0) == allowed
    assert not family(os.getpid()) & strangers


def test_the_levels_count_only_walks_of_a_hundred_metres() -> None:
    short, long = (odometry.metrics(0.004, distance, 60.0, IDEAL)[0] for distance in (20.0, 100.0))
    assert short.level(0.1) == "no bounds"
    assert long.level(0.1) == "excellent"


def test_rates_has_nothing_quicker_than_a_short_duration(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rates", "--quick"]) == 2
    assert "a short --duration" in capsys.readouterr().err


@pytest.mark.realtime
def test_all_streams_on_the_real_clock_keep_their_rates_or_are_named() -> None:
    done, result = evaluate("rates", "--duration", "10")
    streams = [row for row in result["metrics"] if row["name"].startswith("RT-") and row["better"] == "larger"]
    slow = [row["name"] for row in streams if row["median"] < 98.0]
    assert len(streams) == 16
    assert result["backend"] == "physics"
    assert (result["clock"], result["duration"]) == ("real", 10.0)
    if slow:
        assert done.stderr.rstrip().endswith(f"below 98 % of its rate: {'; '.join(slow)}")
    else:
        assert "below 98 %" not in done.stderr
    loop = {row["name"]: row["median"] for row in result["metrics"] if "500 Hz" in row["name"]}
    assert {"RT-05 at 500 Hz, period error p99", "RT-05 at 500 Hz, deadlines missed"} <= loop.keys()


@pytest.mark.slow(reason="a whole patrol")
def test_the_pose_on_the_map_is_measured_against_the_truth() -> None:
    done, result = evaluate("odometry", "--only", "patrol", "--seeds", "1", "--seconds", "10")
    found = {row["name"].partition(" with")[0].partition(" in")[0]: row["median"] for row in result["metrics"]}
    assert found["distance walked"] > 3.0
    assert done.returncode == 0, done.stderr
    assert 0.0 < found["pose error"] < 0.03
    assert 0.0 < found["heading error"] < 1.0
