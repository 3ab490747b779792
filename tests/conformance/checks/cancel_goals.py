"""Vectors of `cancel_goals`: which goals a cancel request selects, and what is answered."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from actors.goals import NO_GOAL_ID, CancelCode, GoalEvent, GoalRecord, GoalTable


def cases(path: Path) -> Iterator[tuple[str, str, Callable[[], None]]]:
    """The cases of the vector file `path`: id, tier, and a callable that raises AssertionError."""
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        check = _return_code_value if case["input"].get("kind") == "return_code_value" else _cancel
        yield case["id"], case["tier"], lambda check=check, case=case: check(case["input"], case["expect"])


def _return_code_value(given: dict[str, Any], expect: dict[str, Any]) -> None:
    assert CancelCode[given["name"].upper()].value == expect["value"]


def _cancel(given: dict[str, Any], expect: dict[str, Any]) -> None:
    table = GoalTable()
    for goal in given["goals"]:
        _bring_to(table, table.accept(_goal_id(goal["id"]), goal["accepted_stamp_ns"]), goal["state"])
    asked: list[str] = []

    def agrees(record: GoalRecord) -> bool:
        asked.append(_name(record))
        return _name(record) not in given["cancel_callback_rejects"]

    request = given["request"]
    wanted = NO_GOAL_ID if request["goal_id"] is None else _goal_id(request["goal_id"])
    outcome = table.cancel(wanted, request["stamp_ns"], agrees)
    assert outcome.code.name.lower() == expect["return_code"]
    assert outcome.code.value == expect["return_code_value"]
    assert [_name(record) for record in outcome.goals] == expect["goals_canceling"]
    assert asked == expect["selected_for_cancel_callback"]
    assert all(record.status.name == "CANCELING" for record in outcome.goals)


def _bring_to(table: GoalTable, record: GoalRecord, state: str) -> None:
    """Walk a goal that has just been accepted to `state`, on legal transitions only."""
    if state in ("canceling", "canceled"):
        table.cancel(record.goal_id)
    elif state != "accepted":
        table.execute(record)
    event = {"succeeded": GoalEvent.SUCCEED, "aborted": GoalEvent.ABORT, "canceled": GoalEvent.CANCELED}.get(state)
    if event is not None:
        table.end(record, event, record.stamp_ns)
    assert record.status.name.lower() == state


def _goal_id(name: str) -> bytes:
    return name.encode().ljust(16, b"\0")


def _name(record: GoalRecord) -> str:
    return record.goal_id.rstrip(b"\0").decode()
