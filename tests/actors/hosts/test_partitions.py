"""A tree over three simulated hosts while its network breaks: more seeds by `python -m tests.chaos hosts --seeds 500`."""

from __future__ import annotations

import pytest

from tests.chaos.hosts import PLANTED, TAKEN_OVER, judge, run_seed
from tests.chaos.hosts import Journal as Acts


@pytest.mark.parametrize("seed", range(6))
def test_never_do_two_incarnations_act_at_the_same_time_and_somebody_always_takes_over(seed: int) -> None:
    outcome = run_seed(seed)

    assert outcome.faults == []
    assert outcome.incarnations > 1
    assert outcome.longest <= TAKEN_OVER


def test_late_commands_of_old_incarnations_come_and_are_refused() -> None:
    assert sum(run_seed(seed).refused for seed in (3, 5, 7)) > 0


def test_the_same_seed_has_the_same_course() -> None:
    assert run_seed(2) == run_seed(2)


LATE = {"lease-from-answer": 24}
"""The seeds that show what few do."""


@pytest.mark.parametrize("plant", PLANTED)
def test_a_planted_violation_is_found(plant: str) -> None:
    assert any(run_seed(seed, plant).faults for seed in (LATE.get(plant, 0), *range(30)))


def test_the_judge_sees_an_old_life_that_acts_again_a_gap_and_a_late_command_that_was_followed() -> None:
    acts = Acts()
    acts.begun = [0.0]
    acts.acts = {
        "near": [(1.0, 0, 1), (2.0, 0, 2), (2.5, 0, 1), (9.0, 0, 2)],
        "far": [(1.0, 0, 1), (3.0, 0, 1), (6.0, 0, 2), (9.0, 0, 2)],
    }
    acts.followed = [(0, 1), (0, 2), (0, 2), (0, 1)]

    outcome = judge(acts, [(0.0, 10.0, True), (10.0, 30.0, False)])

    assert outcome.faults == [
        "near: life 1 acts at 2.500 s, after life 2 at 2.000 s",
        "near: nobody acted for 6.50 s between 0.00 and 10.00 s",
        "the drive followed life 1 of run 0 after life 2 of run 0",
    ]


def test_the_judge_sees_an_earlier_run_that_acts_too_long_and_a_command_of_it_that_was_followed() -> None:
    acts = Acts()
    acts.begun = [0.0, 4.0]
    acts.acts = {
        "near": [(1.0, 0, 9), (5.0, 1, 2), (6.9, 0, 9), (7.1, 0, 9)],
        "far": [(3.0, 0, 9), (5.0, 0, 9), (7.0, 1, 2), (8.0, 1, 2), (10.0, 1, 2)],
    }
    acts.followed = [(0, 9), (1, 2), (0, 9)]

    outcome = judge(acts, [(4.0, 10.0, True)])

    assert outcome.faults == [
        "near: run 0 acts at 7.100 s, run 1 has begun at 4.000 s",
        "near: nobody acted for 5.00 s between 4.00 and 10.00 s",
        "the drive followed life 9 of run 0 after life 2 of run 1",
    ]
