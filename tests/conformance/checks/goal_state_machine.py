"""Vectors of `goal_state_machine`: transitions, codes and flags of goal states."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from actors.actions.goals import GoalEvent, GoalStatus, next_status
from tests.conformance.checks.common import Case, Vector, by_kind, expected


def cases(path: Path) -> Iterator[Case]:
    return by_kind(path, {"transition": _transition, "status_value": _status_value, "flags": _flags})


def _transition(vector: Vector) -> None:
    given = vector["input"]
    following = next_status(GoalStatus[given["state"].upper()], GoalEvent[given["event"].upper()])
    next_state = None if following is None else following.name.lower()
    expected(vector["expect"], valid=following is not None, next_state=next_state)


def _status_value(vector: Vector) -> None:
    expected(vector["expect"], value=GoalStatus[vector["input"]["status"].upper()].value)


def _flags(vector: Vector) -> None:
    status = GoalStatus[vector["input"]["state"].upper()]
    flags = ("is_active", "is_cancelable", "is_terminal")
    expected(vector["expect"], **{flag: getattr(status, flag) for flag in flags})
