"""The goals of an action server by the rules of ROS 2: states, cancel requests, the list for the status topic, kept results.

Pure data structures: nothing here waits or sends, and callers pass the time as integer nanoseconds on the server's clock. The rules are
those of rcl_action. Where its releases differ, a result is kept for `result_timeout` after the goal has *ended*, not after it was accepted.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Callable, Iterable
from enum import IntEnum
from typing import Final, NamedTuple

from actors.actions.peers import GoalFollower
from actors.contracts.contracts import Aborted, Done
from actors.errors import ActorError
from actors.interfaces.message import Message
from actors.waiting import Waiters

DEFAULT_RESULT_TIMEOUT_NS: Final = 10_000_000_000
"""How long a result is kept after its goal has ended, by default: 10 s, as in ROS 2."""

NO_GOAL_ID: Final = bytes(16)
"""The id of a cancel request that names no goal."""


class GoalStatus(IntEnum):
    """The state of a goal, numbered as in `action_msgs/msg/GoalStatus`."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_active(self) -> bool:
        """True for ACCEPTED, EXECUTING and CANCELING: the goal has not ended."""
        return GoalStatus.ACCEPTED <= self <= GoalStatus.CANCELING

    @property
    def is_cancelable(self) -> bool:
        """True for ACCEPTED and EXECUTING: a cancel request can still be accepted."""
        return self is GoalStatus.ACCEPTED or self is GoalStatus.EXECUTING

    @property
    def is_terminal(self) -> bool:
        """True for SUCCEEDED, CANCELED and ABORTED: the goal has ended."""
        return self >= GoalStatus.SUCCEEDED


class GoalEvent(IntEnum):
    """An event that changes the state of a goal."""

    EXECUTE = 0
    CANCEL_GOAL = 1
    SUCCEED = 2
    ABORT = 3
    CANCELED = 4


_NEXT: Final[dict[tuple[GoalStatus, GoalEvent], GoalStatus]] = {
    (GoalStatus.ACCEPTED, GoalEvent.EXECUTE): GoalStatus.EXECUTING,
    (GoalStatus.ACCEPTED, GoalEvent.CANCEL_GOAL): GoalStatus.CANCELING,
    (GoalStatus.EXECUTING, GoalEvent.CANCEL_GOAL): GoalStatus.CANCELING,
    (GoalStatus.EXECUTING, GoalEvent.SUCCEED): GoalStatus.SUCCEEDED,
    (GoalStatus.EXECUTING, GoalEvent.ABORT): GoalStatus.ABORTED,
    (GoalStatus.CANCELING, GoalEvent.SUCCEED): GoalStatus.SUCCEEDED,
    (GoalStatus.CANCELING, GoalEvent.ABORT): GoalStatus.ABORTED,
    (GoalStatus.CANCELING, GoalEvent.CANCELED): GoalStatus.CANCELED,
}


def next_status(status: GoalStatus, event: GoalEvent) -> GoalStatus | None:
    """Return the state after `event`, or None if the event is illegal in this state.

    A goal becomes CANCELED only from CANCELING, and ends only from EXECUTING or CANCELING. A goal that is CANCELING may still succeed or
    abort. Nothing follows a terminal state.
    """
    return _NEXT.get((status, event))


class InvalidGoalTransition(ActorError):
    """Raised for an event that the goal's state does not allow. The goal is unchanged."""


class DuplicateGoal(ActorError):
    """Raised for a goal id that the server still knows."""


class GoalRecord:
    """One goal at its server, from its acceptance until its result expires. It is the goal's only state machine.

    Invariants:

    * `status` alone says how far the goal has come. Only its `GoalTable` changes it, by legal transitions.
    * `result`, `reason` and `ended_ns` (the time of the end in nanoseconds) are valid once the status is terminal.
    * `interruption`, the reason for interrupting the body, is set at most once, and neither after `last` nor after the end. If the status
      is CANCELING, the reason is a cancel request; otherwise it is the end of the node.
    * `last`, the last item of the body, is set at most once. After that the goal cannot be canceled, and only an error changes its outcome.
    * `task` is set when the goal is started, and `body` when that task begins to run. A goal whose `body` is None is ended by its server.
    """

    __slots__ = (
        "body", "client", "ended_ns", "feedback_count", "goal_id", "interrupted_at", "interruption", "last", "message", "reason", "result",
        "stamp_ns", "status", "task", "waiters",
    )  # fmt: skip

    def __init__(
        self, goal_id: bytes, stamp_ns: int, message: object = None, client: GoalFollower | None = None
    ) -> None:
        self.goal_id: Final = goal_id
        """The goal's id, 16 bytes."""
        self.stamp_ns: Final = stamp_ns
        """When the goal was accepted, in nanoseconds."""
        self.message: Final = message
        self.client = client
        """The client's half of the goal; None for a goal without one, and after the end."""
        self.status = GoalStatus.ACCEPTED
        self.ended_ns = 0
        self.result: object = None
        self.reason = ""
        self.task: asyncio.Task[None] | None = None
        self.body: AsyncGenerator[object, None] | None = None
        self.interruption: str | None = None
        self.interrupted_at: tuple[float, int] = (0.0, 0)
        """The loop time, in seconds, and the number of feedbacks at the last interruption."""
        self.last: Done[Message] | Aborted[Message] | None = None
        self.feedback_count = 0
        self.waiters = Waiters()
        """The tasks that wait for the end."""

    def __repr__(self) -> str:
        return f"<goal {self.goal_id.hex()[:8]} {self.status.name}{f': {self.reason}' if self.reason else ''}>"

    @property
    def is_open(self) -> bool:
        """Whether the goal can still be interrupted: it has not ended and its body has not yielded its last item."""
        return self.last is None and not self.status.is_terminal

    @property
    def interrupted_as(self) -> GoalStatus:
        """The status with which an interrupted goal ends: CANCELED after a cancel request, ABORTED at the end of its node."""
        return GoalStatus.CANCELED if self.status is GoalStatus.CANCELING else GoalStatus.ABORTED


class CancelCode(IntEnum):
    """The return code of a cancel request, numbered as in `action_msgs/srv/CancelGoal`."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL_ID = 2
    GOAL_TERMINATED = 3


class CancelSelection(NamedTuple):
    """The goals that a cancel request selects, in order of acceptance, before the server decides on each of them.

    `code` is the final answer unless it is NONE and the server refuses every candidate.
    """

    code: CancelCode
    candidates: tuple[GoalRecord, ...] = ()


class CancelOutcome(NamedTuple):
    """The answer to a cancel request: its code and the goals that moved to CANCELING, in order of acceptance."""

    code: CancelCode
    goals: tuple[GoalRecord, ...] = ()

    def __repr__(self) -> str:
        return f"<cancel {self.code.name}, {len(self.goals)} goals canceling>"


class GoalTable:
    """The goals that one action server knows, in order of acceptance, until their results expire.

    `result_timeout_ns` is measured from a goal's end. A negative value keeps results forever, 0 drops them at the next `expire`. Operations
    that list or select goals are O(n), and all others O(1) on average. Active goals never expire.

    Invariants:

    * A goal is in `_goals` from its acceptance until its result expires, and in exactly one of `waiting`, `running` and `_ended`.
    * `waiting` holds the goals for which `execute` has not been called, in order of acceptance; `running` those for which it has.
    * `_ended` is ordered by the end of its goals, so that the first one expires first.
    """

    __slots__ = ("_ended", "_goals", "result_timeout_ns", "running", "waiting")

    def __init__(self, result_timeout_ns: int = DEFAULT_RESULT_TIMEOUT_NS) -> None:
        self.result_timeout_ns: Final = result_timeout_ns
        self._goals: dict[bytes, GoalRecord] = {}
        self.waiting: dict[GoalRecord, None] = {}
        self.running: dict[GoalRecord, None] = {}
        self._ended: deque[GoalRecord] = deque()

    def __len__(self) -> int:
        return len(self._goals)

    def __contains__(self, goal_id: object) -> bool:
        return goal_id in self._goals

    def __repr__(self) -> str:
        return f"<goal table: {len(self._goals) - len(self._ended)} active, {len(self._ended)} ended>"

    def get(self, goal_id: bytes) -> GoalRecord | None:
        """The goal of this id; None if it is unknown or has expired."""
        return self._goals.get(goal_id)

    def status_of(self, goal_id: bytes) -> GoalStatus:
        """The state of the goal of this id; UNKNOWN if it is unknown or has expired. Never raises."""
        record = self._goals.get(goal_id)
        return GoalStatus.UNKNOWN if record is None else record.status

    def records(self) -> tuple[GoalRecord, ...]:
        """All goals, including ended ones, in order of acceptance: the content of the status topic."""
        return tuple(self._goals.values())

    def active(self) -> tuple[GoalRecord, ...]:
        """The goals that have not ended, in order of acceptance."""
        return tuple(record for record in self._goals.values() if record.status.is_active)

    def accept(
        self, goal_id: bytes, stamp_ns: int, message: object = None, client: GoalFollower | None = None
    ) -> GoalRecord:
        """Add a new goal as ACCEPTED. Raises DuplicateGoal for an id that is still known, even if its goal has ended."""
        known = self._goals.get(goal_id)
        if known is not None:
            raise DuplicateGoal(
                f"goal id {goal_id.hex()} is already in use ({known.status.name}); make a new id for each goal"
            )
        record = self._goals[goal_id] = GoalRecord(goal_id, stamp_ns, message, client)
        self.waiting[record] = None
        return record

    def execute(self, record: GoalRecord) -> bool:
        """Record that a goal starts: ACCEPTED becomes EXECUTING (returns True); CANCELING stays CANCELING (returns False).

        Raises InvalidGoalTransition in any other state.
        """
        canceled = record.status is GoalStatus.CANCELING
        if not canceled:
            self._advance(record, GoalEvent.EXECUTE)
        self.waiting.pop(record, None)
        self.running[record] = None
        return not canceled

    def end(self, record: GoalRecord, event: GoalEvent, now_ns: int, result: object = None, reason: str = "") -> None:
        """Record that a goal has ended by SUCCEED, ABORT or CANCELED. Its result is kept from now on.

        Raises InvalidGoalTransition, and leaves the goal unchanged, if the event is illegal: CANCELED before CANCELING, an end before
        execution, a second end.
        """
        if event not in (GoalEvent.SUCCEED, GoalEvent.ABORT, GoalEvent.CANCELED):
            raise InvalidGoalTransition(f"{event.name} does not end a goal; use SUCCEED, ABORT or CANCELED")
        self._advance(record, event)
        self.waiting.pop(record, None)
        self.running.pop(record, None)
        record.result = result
        record.reason = reason
        record.ended_ns = now_ns
        self._rebase(now_ns)
        self._ended.append(record)

    def select(self, goal_id: bytes = NO_GOAL_ID, stamp_ns: int = 0) -> CancelSelection:
        """Select the goals that a cancel request refers to. An id of zeros and a stamp of 0 count as not given.

        With neither: all goals. With a stamp: those accepted at or before it. With an id: that goal. With both: that goal *and* those of
        the stamp. Only goals that are ACCEPTED or EXECUTING are selected. The only errors are those of an id without a stamp:
        UNKNOWN_GOAL_ID, and GOAL_TERMINATED if the goal has ended or is already CANCELING.
        """
        named = goal_id != NO_GOAL_ID
        if named and not stamp_ns:
            record = self._goals.get(goal_id)
            if record is None:
                return CancelSelection(CancelCode.UNKNOWN_GOAL_ID)
            if not record.status.is_cancelable:
                return CancelSelection(CancelCode.GOAL_TERMINATED)
            return CancelSelection(CancelCode.NONE, (record,))
        everything = not named and not stamp_ns
        return CancelSelection(
            CancelCode.NONE,
            tuple(
                record
                for record in self._goals.values()
                if record.status.is_cancelable
                and (everything or record.stamp_ns <= stamp_ns or record.goal_id == goal_id)
            ),
        )

    def begin_cancel(self, selection: CancelSelection, agreed: Iterable[GoalRecord]) -> CancelOutcome:
        """Set the goals that the server agreed to cancel to CANCELING. The code is REJECTED if it refused every candidate.

        A goal that has ended since it was selected is left unchanged.
        """
        wanted = {record.goal_id for record in agreed}
        if selection.candidates and not wanted:
            return CancelOutcome(CancelCode.REJECTED)
        moved: list[GoalRecord] = []
        for record in selection.candidates:
            if record.goal_id in wanted and record.status.is_cancelable:
                self._advance(record, GoalEvent.CANCEL_GOAL)
                moved.append(record)
        return CancelOutcome(selection.code, tuple(moved))

    def cancel(
        self, goal_id: bytes = NO_GOAL_ID, stamp_ns: int = 0, agrees: Callable[[GoalRecord], bool] = lambda _: True
    ) -> CancelOutcome:
        """Do `select` and `begin_cancel` in one step, for a server that decides at once."""
        selection = self.select(goal_id, stamp_ns)
        return self.begin_cancel(selection, [record for record in selection.candidates if agrees(record)])

    def next_expiry(self) -> int | None:
        """When the next result expires, in nanoseconds; None if no result does."""
        if self.result_timeout_ns < 0 or not self._ended:
            return None
        return self._ended[0].ended_ns + self.result_timeout_ns

    def expire(self, now_ns: int) -> tuple[GoalRecord, ...]:
        """Remove the goals whose results have expired, and return them. Answer pending result requests first."""
        self._rebase(now_ns)
        gone: list[GoalRecord] = []
        while (due := self.next_expiry()) is not None and due <= now_ns:
            record = self._ended.popleft()
            del self._goals[record.goal_id]
            gone.append(record)
        return tuple(gone)

    def _advance(self, record: GoalRecord, event: GoalEvent) -> None:
        following = next_status(record.status, event)
        if following is None:
            raise InvalidGoalTransition(
                f"goal {record.goal_id.hex()[:8]} is {record.status.name} and cannot take {event.name}"
                + ("; a goal is canceled only after a cancel request" if event is GoalEvent.CANCELED else "")
            )
        record.status = following

    def _rebase(self, now_ns: int) -> None:
        """Move ends that lie in the future to now, after the clock was set back, so that no result outlives its timeout."""
        if self._ended and self._ended[-1].ended_ns > now_ns:
            for record in self._ended:
                record.ended_ns = min(record.ended_ns, now_ns)
