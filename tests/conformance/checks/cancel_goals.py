"""Vectors of `cancel_goals`: which goals a cancel request selects, and what is answered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from actors.actions.goals import NO_GOAL_ID, CancelCode, GoalEvent, GoalRecord, GoalTable
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, expected

REFUSALS = ("cancel_callback_rejects",)
"""What the user refuses, where nobody may ask."""


def cases(path: Path) -> Iterator[Case]:
    return by_kind(path, {None: _cancel, "cancel": _cancel, "return_code_value": _return_code_value}, REFUSALS)


def _return_code_value(vector: Vector) -> None:
    assert CancelCode[vector["input"]["name"].upper()].value == vector["expect"]["value"]


def _cancel(vector: Vector) -> None:
    given, table = vector["input"], GoalTable()
    for goal in given["goals"]:
        _bring_to(table, table.accept(_goal_id(goal["id"]), goal["accepted_stamp_ns"]), goal["state"])
    asked: list[str] = []

    def agrees(record: GoalRecord) -> bool:
        asked.append(_name(record))
        return _name(record) not in given.get("cancel_callback_rejects", [])

    request = given["request"]
    wanted = NO_GOAL_ID if request["goal_id"] is None else _goal_id(request["goal_id"])
    outcome = table.cancel(wanted, request.get("stamp_ns", 0), agrees)
    expected(
        vector["expect"],
        return_code=outcome.code.name.lower(),
        return_code_value=outcome.code.value,
        goals_canceling=[_name(record) for record in outcome.goals],
        selected_for_cancel_callback=asked,
    )
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
    if record.status.name.lower() != state:
        raise Unsupported(f"unsupported state of a goal {state!r}")


def _goal_id(name: str) -> bytes:
    return name.encode().ljust(16, b"\0")


def _name(record: GoalRecord) -> str:
    return record.goal_id.rstrip(b"\0").decode()
