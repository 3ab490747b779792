"""Random lives of an action server's goals against a plain model."""

from __future__ import annotations

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, initialize, invariant, rule

from actors.actions.goals import (
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

IDS = st.integers(1, 6).map(lambda number: bytes([number]) * 16)
ENDS = st.sampled_from([GoalEvent.SUCCEED, GoalEvent.ABORT, GoalEvent.CANCELED])


class Goals(RuleBasedStateMachine):
    """The table, and beside it what should be known: goals in order of acceptance, with the time they are to vanish."""

    records = Bundle("records")

    @initialize(timeout=st.integers(-1, 20))
    def start(self, timeout: int) -> None:
        self.table = GoalTable(timeout)
        self.timeout = timeout
        self.now = 1
        self.known: dict[bytes, GoalStatus] = {}
        self.stamps: dict[bytes, int] = {}
        self.due: dict[bytes, int] = {}

    @rule(goal_id=IDS, target=records)
    def accept(self, goal_id: bytes) -> GoalRecord:
        if goal_id in self.known:
            with pytest.raises(DuplicateGoal):
                self.table.accept(goal_id, self.now)
            known = self.table.get(goal_id)
            assert known is not None
            return known
        record = self.table.accept(goal_id, self.now)
        self.known[goal_id] = GoalStatus.ACCEPTED
        self.stamps[goal_id] = self.now
        return record

    @rule(record=records)
    def execute(self, record: GoalRecord) -> None:
        before = record.status
        if before is GoalStatus.CANCELING:
            assert not self.table.execute(record)
        elif before is GoalStatus.ACCEPTED:
            assert self.table.execute(record)
            self.known[record.goal_id] = GoalStatus.EXECUTING
        else:
            with pytest.raises(InvalidGoalTransition):
                self.table.execute(record)
            assert record.status is before

    @rule(record=records, event=ENDS)
    def end(self, record: GoalRecord, event: GoalEvent) -> None:
        before = record.status
        after = next_status(before, event)
        if after is None:
            with pytest.raises(InvalidGoalTransition):
                self.table.end(record, event, self.now)
            assert record.status is before
            return
        assert not before.is_terminal
        self.table.end(record, event, self.now, result=event.name)
        assert record.result == event.name
        self.known[record.goal_id] = after
        if self.timeout >= 0:
            self.due[record.goal_id] = self.now + self.timeout

    @rule(goal_id=st.one_of(st.just(NO_GOAL_ID), IDS), stamp=st.integers(0, 60), refused=st.sets(IDS))
    def cancel(self, goal_id: bytes, stamp: int, refused: set[bytes]) -> None:
        cancelable = [known for known, status in self.known.items() if status.is_cancelable]
        if goal_id != NO_GOAL_ID and not stamp:
            selected = [known for known in cancelable if known == goal_id]
        elif goal_id == NO_GOAL_ID and not stamp:
            selected = cancelable
        else:
            selected = [known for known in cancelable if known == goal_id or self.stamps[known] <= stamp]
        agreed = [known for known in selected if known not in refused]
        if goal_id != NO_GOAL_ID and not stamp and not selected:
            code = CancelCode.GOAL_TERMINATED if goal_id in self.known else CancelCode.UNKNOWN_GOAL_ID
        else:
            code = CancelCode.REJECTED if selected and not agreed else CancelCode.NONE
        asked: list[bytes] = []

        def agrees(record: GoalRecord) -> bool:
            asked.append(record.goal_id)
            return record.goal_id not in refused

        outcome = self.table.cancel(goal_id, stamp, agrees)
        assert (outcome.code, asked) == (code, selected)
        assert [record.goal_id for record in outcome.goals] == agreed
        self.known.update(dict.fromkeys(agreed, GoalStatus.CANCELING))

    @rule(passed=st.integers(0, 15))
    def pass_time(self, passed: int) -> None:
        self.now += passed
        due = min(self.due.values(), default=None)
        assert self.table.next_expiry() == due
        gone = [record.goal_id for record in self.table.expire(self.now)]
        assert sorted(gone) == sorted(known for known, moment in self.due.items() if moment <= self.now)
        for goal_id in gone:
            del self.known[goal_id], self.due[goal_id], self.stamps[goal_id]

    @rule(back=st.integers(1, 30))
    def set_the_clock_back(self, back: int) -> None:
        self.now = max(self.now - back, 0)
        self.due = {known: min(moment, self.now + self.timeout) for known, moment in self.due.items()}
        self.table.expire(self.now)
        for goal_id in [known for known, moment in self.due.items() if moment <= self.now]:
            del self.known[goal_id], self.due[goal_id], self.stamps[goal_id]

    @rule(record=consumes(records))
    def forget_a_record(self, record: GoalRecord) -> None:
        """Keep the bundle short, so that the other rules meet goals that are alive."""

    @invariant()
    def the_table_knows_what_the_model_knows(self) -> None:
        if hasattr(self, "table"):
            assert {record.goal_id: record.status for record in self.table.records()} == self.known
            assert [record.goal_id for record in self.table.records()] == list(self.known)
            assert all(self.table.status_of(known) is status for known, status in self.known.items())
            assert len(self.table.active()) == sum(status.is_active for status in self.known.values())
            assert {*self.table.waiting, *self.table.running} == {*self.table.active()}
            assert len(self.table.waiting) + len(self.table.running) == len(self.table.active())
            assert all(record.status is not GoalStatus.EXECUTING for record in self.table.waiting)
            assert all(record.status is not GoalStatus.ACCEPTED for record in self.table.running)


TestGoals = Goals.TestCase
TestGoals.settings = settings(deadline=None, stateful_step_count=40)
