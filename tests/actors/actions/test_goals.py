"""Goals of an action server: legal ends, cancel requests, kept results."""

from __future__ import annotations

import pytest

from actors.actions.goals import (
    DEFAULT_RESULT_TIMEOUT_NS,
    NO_GOAL_ID,
    CancelCode,
    DuplicateGoal,
    GoalEvent,
    GoalRecord,
    GoalStatus,
    GoalTable,
    InvalidGoalTransition,
    next_status,
)

SECOND = 1_000_000_000


def goal_id(number: int) -> bytes:
    return bytes([number]) * 16


def running(table: GoalTable, number: int, stamp_ns: int = 0) -> GoalRecord:
    record = table.accept(goal_id(number), stamp_ns)
    assert table.execute(record)
    return record


def ids(records: tuple[GoalRecord, ...]) -> list[int]:
    return [record.goal_id[0] for record in records]


def test_the_legal_transitions_are_these_eight() -> None:
    legal = {
        f"{status.name} {event.name} {after.name}"
        for status in GoalStatus
        for event in GoalEvent
        if (after := next_status(status, event)) is not None
    }
    assert legal == {
        "ACCEPTED EXECUTE EXECUTING",
        "ACCEPTED CANCEL_GOAL CANCELING",
        "EXECUTING CANCEL_GOAL CANCELING",
        "EXECUTING SUCCEED SUCCEEDED",
        "EXECUTING ABORT ABORTED",
        "CANCELING SUCCEED SUCCEEDED",
        "CANCELING ABORT ABORTED",
        "CANCELING CANCELED CANCELED",
    }


def test_a_state_is_active_cancelable_or_terminal() -> None:
    assert [status.name for status in GoalStatus if status.is_active] == ["ACCEPTED", "EXECUTING", "CANCELING"]
    assert [status.name for status in GoalStatus if status.is_cancelable] == ["ACCEPTED", "EXECUTING"]
    assert [status.name for status in GoalStatus if status.is_terminal] == ["SUCCEEDED", "CANCELED", "ABORTED"]


def test_a_goal_goes_from_accepted_over_executing_to_its_result() -> None:
    table = GoalTable()
    record = table.accept(goal_id(1), 5)
    assert (record.status, record.stamp_ns, goal_id(1) in table, len(table)) == (GoalStatus.ACCEPTED, 5, True, 1)
    assert table.execute(record)
    assert table.active() == (record,)
    assert record.ended_ns == 0, "it has not ended"
    table.end(record, GoalEvent.SUCCEED, 9, result="there", reason="")
    assert (record.status, record.result, record.ended_ns) == (GoalStatus.SUCCEEDED, "there", 9)
    assert (table.records(), table.active()) == ((record,), ())
    assert repr(table) == "<goal table: 0 active, 1 ended>"


def test_a_goal_tells_what_became_of_it() -> None:
    table = GoalTable()
    record = running(table, 1)
    assert repr(record) == "<goal 01010101 EXECUTING>"
    table.end(record, GoalEvent.ABORT, 0, reason="fell over")
    assert repr(record) == "<goal 01010101 ABORTED: fell over>"


def test_an_illegal_event_is_an_error_and_changes_nothing() -> None:
    table = GoalTable()
    record = table.accept(goal_id(1), 0)
    with pytest.raises(InvalidGoalTransition, match="01010101 is ACCEPTED and cannot take SUCCEED"):
        table.end(record, GoalEvent.SUCCEED, 1, "result")
    table.execute(record)
    with pytest.raises(InvalidGoalTransition, match="canceled only after a cancel request"):
        table.end(record, GoalEvent.CANCELED, 1, "result")
    with pytest.raises(InvalidGoalTransition, match="cannot take EXECUTE"):
        table.execute(record)
    with pytest.raises(InvalidGoalTransition, match="EXECUTE does not end a goal"):
        table.end(record, GoalEvent.EXECUTE, 1)
    assert (record.status, record.result, table.next_expiry()) == (GoalStatus.EXECUTING, None, None)


def test_the_first_end_counts() -> None:
    table = GoalTable()
    record = running(table, 1)
    table.cancel(goal_id(1))
    table.end(record, GoalEvent.SUCCEED, 1, "reached")
    with pytest.raises(InvalidGoalTransition):
        table.end(record, GoalEvent.CANCELED, 2, "not reached")
    assert (record.status, record.result) == (GoalStatus.SUCCEEDED, "reached")


def test_a_goal_canceled_before_it_runs_stays_canceling() -> None:
    table = GoalTable()
    record = table.accept(goal_id(1), 0)
    table.cancel(goal_id(1))
    assert not table.execute(record)
    assert record.status is GoalStatus.CANCELING
    table.end(record, GoalEvent.CANCELED, 1)
    assert table.status_of(goal_id(1)) is GoalStatus.CANCELED


def test_an_id_is_taken_as_long_as_the_goal_is_known() -> None:
    table = GoalTable(SECOND)
    record = running(table, 1)
    with pytest.raises(DuplicateGoal, match=r"in use \(EXECUTING\)"):
        table.accept(goal_id(1), 1)
    table.end(record, GoalEvent.SUCCEED, 0)
    with pytest.raises(DuplicateGoal, match=r"in use \(SUCCEEDED\)"):
        table.accept(goal_id(1), 1)
    table.expire(SECOND)
    assert table.accept(goal_id(1), 2).stamp_ns == 2


def test_an_unknown_goal_is_an_answer_and_not_an_error() -> None:
    table = GoalTable()
    assert table.status_of(goal_id(1)) is GoalStatus.UNKNOWN
    assert table.get(goal_id(1)) is None


# -- cancel requests --------------------------------------------------------------------------------------------------


@pytest.fixture
def five() -> GoalTable:
    """Goals 1 to 5, accepted at 10 to 50: executing, canceling, succeeded, accepted, executing."""
    table = GoalTable()
    for number in range(1, 6):
        table.accept(goal_id(number), number * 10)
    for number in (1, 3, 5):
        table.execute(table.records()[number - 1])
    table.cancel(goal_id(2))
    table.end(table.records()[2], GoalEvent.SUCCEED, 99)
    return table


@pytest.mark.parametrize(
    ("wanted", "stamp_ns", "canceling"),
    [
        (NO_GOAL_ID, 0, [1, 4, 5]),
        (NO_GOAL_ID, 40, [1, 4]),
        (NO_GOAL_ID, 9, []),
        (goal_id(4), 0, [4]),
        (goal_id(5), 10, [1, 5]),
        (goal_id(3), 10, [1]),
        (goal_id(9), 40, [1, 4]),
        (goal_id(2), 5, []),
    ],
)
def test_the_four_forms_of_a_cancel_request(
    five: GoalTable, wanted: bytes, stamp_ns: int, canceling: list[int]
) -> None:
    outcome = five.cancel(wanted, stamp_ns)
    assert (outcome.code, ids(outcome.goals)) == (CancelCode.NONE, canceling)
    assert repr(outcome) == f"<cancel NONE, {len(canceling)} goals canceling>"


@pytest.mark.parametrize(
    ("wanted", "code"),
    [
        (goal_id(9), CancelCode.UNKNOWN_GOAL_ID),
        (goal_id(3), CancelCode.GOAL_TERMINATED),
        (goal_id(2), CancelCode.GOAL_TERMINATED),
    ],
)
def test_only_an_id_without_a_stamp_can_be_wrong(five: GoalTable, wanted: bytes, code: CancelCode) -> None:
    outcome = five.cancel(wanted)
    assert (outcome.code, outcome.goals) == (code, ())


def test_the_answers_to_a_cancel_request_are_numbered_as_in_ros_2() -> None:
    assert {code.name: code.value for code in CancelCode} == {
        "NONE": 0,
        "REJECTED": 1,
        "UNKNOWN_GOAL_ID": 2,
        "GOAL_TERMINATED": 3,
    }


def test_a_server_may_refuse_some_or_all(five: GoalTable) -> None:
    assert five.cancel(agrees=lambda record: False).code is CancelCode.REJECTED
    assert five.cancel(goal_id(1), agrees=lambda record: False).code is CancelCode.REJECTED
    outcome = five.cancel(agrees=lambda record: record.goal_id == goal_id(4))
    assert (outcome.code, ids(outcome.goals)) == (CancelCode.NONE, [4])
    assert five.status_of(goal_id(1)) is GoalStatus.EXECUTING


def test_a_goal_that_ends_while_the_server_is_asked_is_left_alone(five: GoalTable) -> None:
    selection = five.select()
    assert ids(selection.candidates) == [1, 4, 5]
    first = selection.candidates[0]
    five.end(first, GoalEvent.SUCCEED, 100, "just in time")
    outcome = five.begin_cancel(selection, selection.candidates)
    assert (outcome.code, ids(outcome.goals)) == (CancelCode.NONE, [4, 5])
    assert (first.status, first.result) == (GoalStatus.SUCCEEDED, "just in time")


def test_canceling_one_goal_leaves_the_others_alone(five: GoalTable) -> None:
    five.cancel(goal_id(1))
    assert [record.status.name for record in five.records()] == [
        "CANCELING",
        "CANCELING",
        "SUCCEEDED",
        "ACCEPTED",
        "EXECUTING",
    ]


# -- results ----------------------------------------------------------------------------------------------------------


def test_a_result_is_kept_for_its_time_after_the_end() -> None:
    table = GoalTable(SECOND)
    record = running(table, 1, stamp_ns=0)
    table.end(record, GoalEvent.SUCCEED, 100 * SECOND, "late")
    assert table.next_expiry() == 101 * SECOND
    assert table.expire(101 * SECOND - 1) == ()
    assert table.get(goal_id(1)) is record
    assert table.expire(101 * SECOND) == (record,)
    assert table.status_of(goal_id(1)) is GoalStatus.UNKNOWN
    assert table.next_expiry() is None


def test_results_go_in_the_order_in_which_goals_ended_and_active_goals_stay() -> None:
    table = GoalTable(SECOND)
    first, second, third = (running(table, number) for number in (1, 2, 3))
    table.end(second, GoalEvent.SUCCEED, 1)
    table.end(first, GoalEvent.ABORT, 2)
    assert ids(table.records()) == [1, 2, 3]
    assert table.expire(SECOND + 1) == (second,)
    assert table.expire(10 * SECOND) == (first,)
    assert table.records() == (third,)


def test_a_timeout_of_zero_drops_results_at_once_and_a_negative_one_never() -> None:
    at_once, never = GoalTable(0), GoalTable(-1)
    for table in (at_once, never):
        table.end(running(table, 1), GoalEvent.SUCCEED, 7)
    assert len(at_once.expire(7)) == 1
    assert never.expire(10**18) == ()
    assert never.next_expiry() is None
    assert GoalTable().result_timeout_ns == DEFAULT_RESULT_TIMEOUT_NS == 10 * SECOND


def test_a_clock_that_goes_back_does_not_keep_results_longer() -> None:
    table = GoalTable(SECOND)
    table.end(running(table, 1), GoalEvent.SUCCEED, 100 * SECOND)
    table.end(running(table, 2), GoalEvent.SUCCEED, 5 * SECOND)
    assert table.expire(5 * SECOND) == ()
    assert ids(table.expire(6 * SECOND)) == [1, 2]
    table.end(running(table, 3), GoalEvent.SUCCEED, 50 * SECOND)
    assert table.expire(0) == ()
    assert ids(table.expire(SECOND)) == [3]
