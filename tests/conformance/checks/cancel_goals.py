"""Vectors of `cancel_goals`: which goals a cancel request selects, and what is answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from actors.actions.goals import NO_GOAL_ID, CancelCode, GoalEvent, GoalRecord, GoalTable
from actors.interfaces.action_msgs.msg import GoalInfo
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.unique_identifier_msgs.msg import UUID
from tests.conformance import crossing
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
    response = _asked(table, wanted, request.get("stamp_ns", 0), agrees)
    canceling = [info.goal_id.uuid.tobytes() for info in response.goals_canceling]
    expected(
        vector["expect"],
        return_code=CancelCode(response.return_code).name.lower(),
        return_code_value=response.return_code,
        goals_canceling=[goal.rstrip(b"\0").decode() for goal in canceling],
        selected_for_cancel_callback=asked,
    )
    assert all(table.status_of(goal).name == "CANCELING" for goal in canceling)


def _asked(table: GoalTable, wanted: bytes, stamp_ns: int, agrees: Callable[[GoalRecord], bool]) -> CancelGoal.Response:
    """Ask for goals to be canceled as a client of the action does."""

    def answer(request: CancelGoal.Request) -> CancelGoal.Response:
        stamp = request.goal_info.stamp
        outcome = table.cancel(
            request.goal_info.goal_id.uuid.tobytes(), stamp.sec * 1_000_000_000 + stamp.nanosec, agrees
        )
        infos = [GoalInfo(goal_id=UUID(uuid=record.goal_id)) for record in outcome.goals]
        return CancelGoal.Response(return_code=outcome.code.value, goals_canceling=infos)

    stamp = Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)
    info = GoalInfo(goal_id=UUID(uuid=wanted), stamp=stamp)
    response: CancelGoal.Response = crossing.ask(CancelGoal, answer, CancelGoal.Request(goal_info=info))
    return response


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
