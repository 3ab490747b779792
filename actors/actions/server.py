"""The serving side of actions: which goals are accepted, which of them run, and what becomes of a goal that is canceled or has ended."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from typing import TYPE_CHECKING, Any, Final

from actors.actions.arrivals import places, refusal
from actors.actions.driver import GoalDriver, GoalHandlers, GoalObservers, Host
from actors.actions.goals import CancelOutcome, GoalEvent, GoalRecord, GoalStatus, GoalTable
from actors.actions.peers import GoalFollower, Outcome
from actors.actions.requests import CancelRequest, GoalRequest
from actors.errors import Reject, described
from actors.inbox.control import blame

if TYPE_CHECKING:
    from actors.contracts.contracts import Action, ArrivalPolicy
    from actors.services.peers import Registration

__all__ = ["ActionServer"]

_EVENTS: Final = {
    GoalStatus.SUCCEEDED: GoalEvent.SUCCEED,
    GoalStatus.CANCELED: GoalEvent.CANCELED,
    GoalStatus.ABORTED: GoalEvent.ABORT,
}


class ActionServer:
    """One node's action: which goals are accepted, wait, run and are remembered.

    Invariants:

    * A goal lies in `table`, and nowhere else, from its acceptance until its result expires. Its `GoalRecord` is its only state.
    * A request without an answer, for a goal or for its cancellation, lies in `requests`, and is answered at the latest by `fail_all`.
    * No more goals run than there are places for; while there is a place, no goal waits.
    * A goal that waits has no task. A goal that runs has one, and `GoalDriver.run` ends it there; only a goal whose body has not begun is
      ended from here, and so is what is left when the node has ended.
    * The goal's client hears of every change of the status, and of the outcome last; then it is forgotten, so that neither keeps the other
      alive.
    * While results are kept that expire, `_expiry` is the one timer that drops them.
    """

    __slots__ = (
        "_driver",
        "_expiry",
        "_places",
        "action",
        "arrivals",
        "entry",
        "goals",
        "handlers",
        "label",
        "node",
        "observers",
        "requests",
        "table",
        "type",
    )

    def __init__(
        self,
        node: Host,
        entry: Registration,
        action: Action[Any, Any, Any],
        handlers: GoalHandlers,
        arrivals: ArrivalPolicy,
        result_timeout: float,
    ) -> None:
        self.node = node
        self.entry = entry
        self.action = action
        self.type: type[Any] = action.type
        self.handlers = handlers
        self.label = handlers.label
        self.arrivals = arrivals
        self.table = GoalTable(round(result_timeout * 1e9))
        self.requests: dict[GoalRequest | CancelRequest, None] = {}
        self.observers = GoalObservers()
        self.goals = 0
        """How many goals have been asked for."""
        self._places = places(arrivals)
        self._driver = GoalDriver(node, action, handlers, self.observers, self._end, self._start_next)
        self._expiry: asyncio.TimerHandle | asyncio.Future[bool] | None = None

    def __repr__(self) -> str:
        return f"<server of {self.entry.name} in {self.node.fqn}: {len(self.running)} running, {len(self.waiting)} waiting>"

    @property
    def host(self) -> str:
        return self.node.fqn

    @property
    def running(self) -> Collection[GoalRecord]:
        """The goals whose bodies have begun or are about to, in the order in which they began."""
        return self.table.running

    @property
    def waiting(self) -> Collection[GoalRecord]:
        """The goals that are accepted and wait for their turn, in order of acceptance."""
        return self.table.waiting

    def describe(self, goal: GoalRecord) -> str:
        """A goal of this server, for reports."""
        return f"<goal {goal.goal_id.hex()[:8]} of {self.entry.name}: {goal.status.name}>"

    def unanswered(self, seconds: float) -> str:
        busy = self.node.inbox.current
        work = f"busy with {busy.label}" if busy is not None else "not ready"
        return (
            f"{self.host}, which serves {self.entry.name}, neither accepted nor rejected the goal within {seconds:g} s: it is {work}; "
            "declare a handler that waits concurrent=n, or give the goal more time"
        )

    # -- acceptance ----------------------------------------------------------------------------------------------------------

    def submit(self, goal_id: bytes, message: Any, client: GoalFollower | None) -> GoalRequest:
        """Ask for acceptance, in the node's turn, and let `client` follow the goal."""
        self.goals += 1
        request = GoalRequest(self, goal_id, message, client)
        self.requests[request] = None
        self.node.inbox.put_control(request)
        return request

    async def consider(self, request: GoalRequest) -> None:
        """Accept or reject. Nothing happens to other goals before it is certain that this one is accepted."""
        if request.answered:  # the client has gone
            self.requests.pop(request, None)
            return
        try:
            self._expire()
            if request.goal_id in self.table:
                raise Reject(f"goal id {request.goal_id.hex()} is in use already: make a new id for each goal")
            if self.handlers.accepts is not None:
                verdict = self.handlers.accepts(request.message)
                if verdict is not None:
                    await verdict
            if not request.answered:
                self._make_place()
        except Reject as rejection:
            self._reject(request, rejection)
        except BaseException as error:
            failure = blame(error, self.label)
            if failure is None:
                raise
            self._reject(request, Reject(f"the acceptance check failed: {described(failure)}"))
            if not isinstance(failure, Exception):
                raise
            self.node.goal_failed(self.label, failure)
        else:
            self.requests.pop(request, None)
            if not request.answered:
                self._accept(request)

    def _accept(self, request: GoalRequest) -> None:
        goal = self.table.accept(request.goal_id, self.node.clock.wall_ns(), request.message, request.client)
        self._changed(goal)
        request.future.set_result(goal.stamp_ns)
        self._start_next()

    def _reject(self, request: GoalRequest, rejection: Reject) -> None:
        self.requests.pop(request, None)
        request.fail(rejection)

    def _make_place(self) -> None:
        """Let a goal in by the arrival policy, or raise `Reject`."""
        if self.arrivals.policy == "preempt":
            for other in (*self.waiting, *self.running):
                self._cancel(other, "preempted by a newer goal")
        elif (why := refusal(self.arrivals, len(self.waiting), len(self.running))) is not None:
            raise Reject(why)

    def _start_next(self) -> None:
        table = self.table
        while table.waiting and len(table.running) < self._places:
            goal = next(iter(table.waiting))
            table.execute(goal)
            self._changed(goal)
            goal.task = self.node.spawn(self._driver.run(goal), name=self.label)

    # -- cancellation --------------------------------------------------------------------------------------------------------

    def cancel(self, goal_id: bytes, reason: str) -> Awaitable[bool]:
        """Cancel a goal if the hook agrees, also when nobody awaits the answer. It is False when the node ends before that."""
        goal = self.table.get(goal_id)
        if goal is not None and goal.interruption is None and goal.is_open and self.handlers.cancels is not None:
            return asyncio.shield(self._ask(goal, reason))
        answer: asyncio.Future[bool] = self.node.inbox.loop.create_future()
        if goal is not None and goal.interruption is not None:
            answer.set_result(goal.status.is_active)
        else:
            answer.set_result(goal is not None and self._cancel(goal, reason))
        return answer

    async def cancel_goals(self, goal_id: bytes, stamp_ns: int, reason: str) -> CancelOutcome:
        """A cancel request in one of the four forms of `GoalTable.select`; asks the hook for each goal that it means."""
        self._expire()
        selection = self.table.select(goal_id, stamp_ns)
        asked = [goal for goal in selection.candidates if self._is_cancelable(goal) and await self._may_cancel(goal)]
        outcome = self.table.begin_cancel(selection, [goal for goal in asked if self._is_cancelable(goal)])
        for goal in outcome.goals:
            self._interrupt(goal, reason)
        return outcome

    async def consider_cancel(self, request: CancelRequest) -> None:
        """Ask the hook, and cancel the goal if it agrees and the request says so."""
        hook, goal = self.handlers.cancels, request.goal
        assert hook is not None
        agreed = False
        try:
            if goal.is_open:
                verdict = hook(goal.message)
                agreed = verdict if isinstance(verdict, bool) else await verdict
        except BaseException as error:
            failure = blame(error, request.label)
            if not isinstance(failure, Exception):
                raise
            self.node.goal_failed(request.label, failure)
        else:
            if agreed and request.reason is not None:
                agreed = self._cancel(goal, request.reason)
        finally:
            self.requests.pop(request, None)
            request.answer(agreed)

    @staticmethod
    def _is_cancelable(goal: GoalRecord) -> bool:
        return goal.is_open and goal.interruption is None

    async def _may_cancel(self, goal: GoalRecord) -> bool:
        """What the hook says of this goal. No, when the node ends before it says so."""
        return self.handlers.cancels is None or await asyncio.shield(self._ask(goal, None))

    def _ask(self, goal: GoalRecord, reason: str | None) -> asyncio.Future[bool]:
        """Put the question to the node, in its turn. It is the server's from here on, whatever becomes of who waits for the answer."""
        request = CancelRequest(self, goal, reason)
        self.requests[request] = None
        if self.node.inbox.task is asyncio.current_task():  # it is its turn, and it may wait for the answer
            self.node.spawn(request.run(), name=request.label)
        else:
            self.node.inbox.put_control(request)
        return request.future

    def _cancel(self, goal: GoalRecord, reason: str) -> bool:
        """Begin to cancel: False when it is too late. The body is interrupted where it waits and may clean up."""
        if not goal.is_open:
            return False
        if goal.interruption is None:
            self.table.cancel(goal.goal_id)
            self._interrupt(goal, reason)
        return True

    def _interrupt(self, goal: GoalRecord, reason: str) -> None:
        """Interrupt the body. A goal whose body has not begun ends here and now: a task that is canceled before its first step runs nothing."""
        goal.interruption = reason
        goal.interrupted_at = (self.node.inbox.loop.time(), goal.feedback_count)
        self._changed(goal)
        if goal.task is not None:
            goal.task.cancel()
        if goal.task is None or goal.body is None:
            self._end(goal, Outcome(goal.interrupted_as, reason=reason))
            self._start_next()

    # -- the end of a goal ---------------------------------------------------------------------------------------------------

    def _end(self, goal: GoalRecord, outcome: Outcome) -> None:
        """Enter the outcome into the table, by legal transitions only, and tell everybody; the first one counts."""
        if goal.status.is_terminal:
            return
        if goal.status is GoalStatus.ACCEPTED:  # it never ran: its node ended first
            self.table.execute(goal)
        self.table.end(goal, _EVENTS[outcome.status], self.node.clock.now_ns(), outcome.result, outcome.reason)
        if self._expiry is None:
            self._expire_later(0)
        client, goal.client = goal.client, None
        self._observe()
        if client is not None:
            client.on_result(outcome)
        goal.waiters.wake_all()

    def _changed(self, goal: GoalRecord) -> None:
        if goal.client is not None:
            goal.client.on_status(goal.status)
        self._observe()

    def _observe(self) -> None:
        for observer in self.observers.status:
            observer()

    async def result_of(self, goal_id: bytes) -> tuple[GoalStatus, Any]:
        """Wait for a goal's end: its status and result (None where there is none); UNKNOWN at once for an id that is not known."""
        self._expire()
        goal = self.table.get(goal_id)
        if goal is None:
            return GoalStatus.UNKNOWN, None
        while goal.status.is_active:
            await goal.waiters.wait()
        return goal.status, goal.result

    def _expire(self) -> None:
        self.table.expire(self.node.clock.now_ns())

    def _expire_later(self, wait_ns: int) -> None:
        """Drop the next result when its time is over, also if no goal comes any more, but not before `wait_ns` from now."""
        due = self.table.next_expiry()
        if due is not None:
            clock = self.node.clock
            self._expiry = clock.call_at((max(due, clock.now_ns() + wait_ns) + 1) / 1e9, self._expire_now)

    def _expire_now(self) -> None:
        """A result's time is over: see to all that are over, and to the rest together, at most a tenth of their time late."""
        if self._expiry is not None:
            self._expiry = None
            self._expire()
            self._expire_later(self.table.result_timeout_ns // 10)

    # -- the end of the node -------------------------------------------------------------------------------------------------

    def stop(self, reason: str) -> list[asyncio.Task[None]]:
        """Interrupt every goal, because the node ends; the returned tasks are still cleaning up."""
        for goal in (*self.waiting, *self.running):
            if not goal.is_open:
                assert goal.task is not None
                goal.task.cancel()  # it had its last word; its outcome stands
            elif goal.interruption is None:
                self._interrupt(goal, reason)
        return [goal.task for goal in self.running if goal.task is not None]

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """The node has ended: goals that have not ended are aborted, requests without an answer fail with `error()`."""
        for goal in (*self.waiting, *self.running):
            self._end(goal, Outcome(GoalStatus.ABORTED, reason=str(error())))
        for request in self.requests:
            request.fail(error())
        self.requests.clear()
        expiry, self._expiry = self._expiry, None
        if expiry is not None:
            expiry.cancel()
