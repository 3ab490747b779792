"""What the navigator answers."""

from __future__ import annotations

import dataclasses
import math

import pytest

from robot.navigation.motion import Motion, State


@pytest.mark.parametrize(
    ("state", "running"),
    [
        (State.IDLE, False),
        (State.FOLLOWING, True),
        (State.WAITING, True),
        (State.RECOVERING, True),
        (State.ARRIVED, False),
        (State.CANCELED, False),
        (State.FAILED, False),
    ],
)
def test_a_goal_runs_until_it_has_arrived_or_was_given_up(state: State, running: bool) -> None:
    assert state.running is running


def test_every_state_is_one_of_those_and_reads_as_its_word() -> None:
    assert [str(state) for state in State] == [
        "idle",
        "following",
        "waiting",
        "recovering",
        "arrived",
        "canceled",
        "failed",
    ]


def test_an_answer_without_more_to_say_has_no_failure_and_nothing_near() -> None:
    motion = Motion(0.1, 0.0, 0.0, State.FOLLOWING, 2.0, 4.0)
    assert (motion.failure, motion.detail, motion.clearance) == (None, "", math.inf)
    with pytest.raises(dataclasses.FrozenInstanceError):
        motion.vx = 1.0  # type: ignore[misc]  # pyright: ignore[reportAttributeAccessIssue]
