"""`python -m tests.figures busy`: when control runs on a shared processor, and that the robot does not fall there."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest

from tests.figures import busy
from tests.figures.__main__ import main
from tests.figures.busy_run import walk
from tests.figures.fidelity import IDEAL
from tests.figures.turns import PERIOD, Load, turns

SCARCE = 0.0012
"""Processor time of control, s, of which it gets too little beside two loops."""


def ages(load: Load) -> list[float]:
    return [turn.at - turn.samples[-1] * PERIOD for turn in turns(load, 1, 10.0)]


def test_control_that_takes_each_sample_by_itself_stays_behind_for_good() -> None:
    assert np.median(ages(Load(2, SCARCE, together=False))) > 0.15
    assert np.median(ages(Load(2, 0.0003, together=False))) < 0.01  # where its share is enough it does not


def test_control_that_takes_late_samples_together_catches_up() -> None:
    assert np.median(ages(Load(2, SCARCE))) < 0.01
    assert np.quantile(ages(Load(2, SCARCE)), 0.99) < 0.03


def test_every_sample_is_taken_once_and_in_order() -> None:
    steps = turns(Load(2, SCARCE), 1, 5.0)
    taken = [number for turn in steps for number in turn.samples]
    assert taken == list(range(1, len(taken) + 1))
    assert all(turn.at > turn.samples[-1] * PERIOD for turn in steps)
    assert all(before.at < after.at for before, after in pairwise(steps))


def test_the_same_seed_gives_the_same_turns_and_another_gives_others() -> None:
    load = Load(1, SCARCE)
    assert turns(load, 1, 2.0) == turns(load, 1, 2.0) != turns(load, 2, 2.0)


def test_the_robot_falls_beside_two_loops_when_its_control_stays_behind_and_not_otherwise() -> None:
    assert walk(Load(2, SCARCE, together=False), 2, 8.0, IDEAL, 0.004).fallen is not None
    met = walk(Load(2, SCARCE), 1, 8.0, IDEAL, 0.004)
    assert (met.fallen, met.taken_over) == (None, 0)


def test_the_command_counts_falls(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["busy", "--robots", "1", "--duration", "1", "--loops", "2", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["loops"], row["control"], row["robots"], row["falls"]) for row in rows] == [
        (2, cost, 1, 0) for cost in busy.COSTS
    ]
