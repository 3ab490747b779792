"""`python -m tests.figures sensitivity`: its arithmetic, and what its table says of outcomes that are known."""

from __future__ import annotations

import importlib
import json
from dataclasses import fields
from itertools import islice
from typing import Any

import numpy as np
import pytest

from robot.navigation.follow_config import FollowerConfig
from robot.navigation.navigator_config import NavigatorConfig
from tests.figures import sensitivity
from tests.figures.__main__ import main
from tests.figures.barn_run import Ended, Outcome, Walk
from tests.figures.field_worlds import field_world
from tests.figures.sensitivity import LEFT_OUT, THRESHOLDS, difference, scaled, value_of, wilson
from tests.figures.unmapped import SHEET

stats: Any = importlib.import_module("scipy.stats")  # it has no types


@pytest.mark.parametrize(("successes", "trials"), [(0, 20), (1, 20), (13, 20), (20, 20), (1, 1), (250, 300)])
def test_the_interval_of_a_share_is_wilsons(successes: int, trials: int) -> None:
    expected = stats.binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    found = wilson(successes, trials)
    assert found.value == successes / trials
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_a_difference_is_taken_pair_by_pair() -> None:
    before, changed = [0.1, 0.4, 0.2, 0.5], [0.2, 0.5, 0.3, 0.6]
    found = difference(changed, before)
    # Every world gains the same, so nothing is left to chance, however much the worlds differ.
    assert (found.value, found.low, found.high) == pytest.approx((0.1, 0.1, 0.1))


def test_the_interval_of_a_difference_is_that_of_its_mean() -> None:
    random = np.random.default_rng(1)
    before, changed = random.random(30), random.random(30)
    low, high = stats.norm.interval(0.95, np.mean(changed - before), stats.sem(changed - before))
    found = difference(changed.tolist(), before.tolist())
    assert (found.low, found.high) == pytest.approx((low, high))


def test_one_pair_says_nothing_about_chance() -> None:
    found = difference([0.5], [0.3])
    assert (found.value, found.low, found.high) == (0.2, -np.inf, np.inf)


def test_one_number_is_changed_and_nothing_else() -> None:
    changed = scaled(SHEET, "config.following.comfort", 1.2)
    assert value_of(changed, "config.following.comfort") == pytest.approx(1.2 * 0.32)
    assert scaled(changed, "config.following.comfort", 1 / 1.2) == SHEET
    assert value_of(scaled(SHEET, "margins.roomy", 0.8), "margins.roomy") == pytest.approx(0.072)


def test_every_number_of_navigation_is_varied_or_named_with_the_reason() -> None:
    numbers = {f"config.{field.name}" for field in fields(NavigatorConfig) if field.name != "following"}
    numbers |= {f"config.following.{field.name}" for field in fields(FollowerConfig)}
    told = THRESHOLDS.keys() | LEFT_OUT.keys()
    assert {name for name in told if name.startswith("config.")} == numbers
    assert THRESHOLDS.keys().isdisjoint(LEFT_OUT)
    assert all(value_of(SHEET, name) > 0.0 for name in THRESHOLDS)


@pytest.mark.slow(reason="two walks")
def test_a_changed_number_reaches_the_robot() -> None:
    """Half the speed where it is narrow: it gets less far in the same three seconds."""
    world, gone = field_world(11), list[float]()
    for tuning in (SHEET, scaled(scaled(SHEET, "limits.creep", 0.2), "limits.eagerness", 0.2)):
        walk = Walk(world, "kinematic", 1, tuning)
        for _ in islice(walk.steps(), 60):
            pass
        gone.append(walk.pose().x)
    assert gone[1] < 0.7 * gone[0]


def known(seed: int, path: str, factor: float) -> Outcome:
    """As is every world takes 10 s; with less comfort the second fails, with more each of them takes 2 s longer."""
    ended: Ended = "collision" if (path, factor, seed) == ("config.following.comfort", 0.8, 9002) else "success"
    slower = path == "config.following.comfort" and factor > 1.0
    score = 0.0 if ended == "collision" else 0.3 if slower else 0.4
    return Outcome(seed, 1, ended, 12.0 if slower else 10.0, score)


def test_the_table_holds_counts_means_and_what_is_more_than_chance(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sensitivity, "_walk", known)
    assert main(["sensitivity", "--worlds", "4", "--only", "comfort", "--jobs", "1"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[0] == "navigation, each number 20 % down and up, back end kinematic"
    assert lines[1].startswith("4 worlds a value, field_world(9001) to (9004); ")
    row = lines[4].split()
    assert row[:3] == ["following.comfort", "0.32", "m"]
    assert " ".join(row[3:8]) == "3 / 4 / 4"
    assert " ".join(row[8:13]) == "32.5 / 10.0 / 12.0"  # the failure counts 100 s
    assert " ".join(row[13:18]) == "0.300 / 0.400 / 0.300"
    # one of four loses 0.4: mean -0.1, standard error 0.1; all of them lose 0.1
    assert " ".join(row[18:]) == "-0.100 +- 0.196 -0.100 +- 0.000*"
    assert "95 % (Wilson) of 4: 51 .. 100 %, 3: 30 .. 95 %" in said.out
    assert said.err.startswith("[1/1] following.comfort")


def test_json_holds_every_outcome(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sensitivity, "_walk", known)
    assert main(["sensitivity", "--worlds", "2", "--only", "margins.tight", "comfort", "--jobs", "1", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in result["thresholds"]] == ["margins.tight", "config.following.comfort"]
    assert result["worlds"] == [9001, 9002]
    assert result["usual"] == {"successes": 2, "scores": [0.4, 0.4], "seconds": [10.0, 10.0]}
    assert result["thresholds"][1]["down"]["seconds"] == [10.0, 100.0]


def test_more_processes_walk_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pool's part is to keep the order; the walk itself needs no process of its own to be tested."""
    used: list[int] = []

    class Pool:
        def __init__(self, jobs: int, mp_context: object) -> None:
            used.append(jobs)

        def __enter__(self) -> Pool:
            return self

        def __exit__(self, *_: object) -> None: ...

        map = staticmethod(map)

    monkeypatch.setattr(sensitivity, "_walk", known)
    monkeypatch.setattr(sensitivity, "ProcessPoolExecutor", Pool)
    names = ["config.following.comfort"]
    assert sensitivity.vary(names, [9001, 9002], 3) == sensitivity.vary(names, [9001, 9002], 1)
    assert used == [3]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--only", "confort"], "--only confort: no threshold's name contains that; there are: margins.roomy"),
        (["--worlds", "0"], "argument --worlds: 0: give a whole number from 1 to 1000"),
        (["--jobs", "two"], "argument --jobs: two: give a whole number from 1 to 256"),
        (["--wolrds", "3"], "unrecognized arguments: --wolrds 3; did you mean --worlds?"),
    ],
)
def test_a_mistake_is_one_line(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"figures sensitivity: {told}")
