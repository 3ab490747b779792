"""Vectors of `goal_state_machine`: transitions, codes and flags of goal states."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from actors.goals import GoalEvent, GoalStatus, next_status


def cases(path: Path) -> Iterator[tuple[str, str, Callable[[], None]]]:
    """The cases of the vector file `path`: id, tier, and a callable that raises AssertionError."""
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        check = _CHECKS[case["input"]["kind"]]
        yield case["id"], case["tier"], lambda check=check, case=case: check(case["input"], case["expect"])


def _transition(given: dict[str, Any], expect: dict[str, Any]) -> None:
    following = next_status(GoalStatus[given["state"].upper()], GoalEvent[given["event"].upper()])
    assert (following is not None) == expect["valid"]
    assert (None if following is None else following.name.lower()) == expect["next_state"]


def _status_value(given: dict[str, Any], expect: dict[str, Any]) -> None:
    assert GoalStatus[given["status"].upper()].value == expect["value"]


def _flags(given: dict[str, Any], expect: dict[str, Any]) -> None:
    status = GoalStatus[given["state"].upper()]
    assert {flag: getattr(status, flag) for flag in expect} == expect


_CHECKS = {"transition": _transition, "status_value": _status_value, "flags": _flags}
