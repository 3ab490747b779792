"""The serving side of actions: one task per goal drives the body, an async generator that yields feedback and ends with `Done`.

Whatever interrupts the driver between two steps is thrown into the body, so timeouts and task groups around a ``yield`` are safe.
A body is resumed to its end, never closed inside its scopes; the code after its ``yield Done(...)`` runs.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.actions.goals import CancelOutcome, GoalEvent, GoalRecord, GoalStatus, GoalTable
from actors.contracts.contracts import Aborted, ArrivalPolicy, Done
from actors.errors import Reject, WrongType, described
from actors.inbox.control import Unwinding, blame
from actors.services.services import Caller
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.contracts.contracts import Action
    from actors.graph.graph import ActionEntry
    from actors.interfaces.message import Message
    from actors.time.clock import Clock

__all__ = ["CLEANUP_SECONDS", "ActionServer", "GoalRun", "Host", "Outcome"]

IGNORED = 3
"""A body that goes on yielding after so many cancellations or other errors thrown into it is closed and reported."""

CLEANUP_SECONDS: Final = 5.0
CLEANUP_FEEDBACKS: Final = 1000
"""A canceled body may give feedback while it cleans up, for so long and so many; then it is taken to have ignored the cancellation.

Who leaves a goal's block waits for so long.
"""


_EVENTS: Final = {
    GoalStatus.SUCCEEDED: GoalEvent.SUCCEED,
    GoalStatus.CANCELED: GoalEvent.CANCELED,
    GoalStatus.ABORTED: GoalEvent.ABORT,
}


class Outcome:
    """How a goal ended: its terminal status, what the body handed over (or None), and why.

    It has no public constructor: `Goal.ended` gives one.
    """

    __slots__ = ("reason", "result", "status")

    def __init__(self, status: GoalStatus, result: Any = None, reason: str = "") -> None:
        self.status: Final = status
        self.result: Final = result
        self.reason: Final = reason

    def __repr__(self) -> str:
        return f"<{self.status.name}{f': {self.reason}' if self.reason else ''}>"


class Host(Caller, Protocol):
    """What an action server asks of its node."""

    @property
    def clock(self) -> Clock: ...

    def goal_failed(self, action: str, error: Exception) -> None: ...

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None: ...

    def warn(self, event: str, **fields: object) -> None: ...


class GoalRun:
    """One goal at its server, from its arrival to its outcome. As an inbox item it asks whether it is accepted."""

    __slots__ = (
        "accepted", "begun", "canceled_at_last", "canceling", "feedback_count", "goal_id", "goal_message", "ignored", "interrupted", "last",
        "on_feedback", "on_outcome", "outcome", "record", "server", "task", "verdict", "waiters",
    )  # fmt: skip

    def __init__(self, server: ActionServer, goal_id: bytes, message: Message) -> None:
        self.server = server
        self.goal_id = goal_id
        self.goal_message = message
        self.record: GoalRecord | None = None
        self.accepted: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.task: asyncio.Task[None] | None = None
        self.begun = False
        """Whether the task has come to its first step; before that, canceling it would run nothing of it."""
        self.canceling: str | None = None
        self.verdict = GoalStatus.CANCELED
        """What the goal is when it was interrupted: canceled, or aborted because its node ends."""
        self.last: Done[Any] | Aborted[Any] | None = None
        self.canceled_at_last = False
        self.ignored = 0
        self.interrupted = (0.0, 0)
        """Loop time and feedback count at the last interruption."""
        self.feedback_count = 0
        self.outcome: Outcome | None = None
        self.on_feedback: Callable[[Any], None] | None = None
        self.on_outcome: Callable[[Outcome], None] | None = None
        self.waiters = Waiters()

    def __repr__(self) -> str:
        return f"<goal {self.goal_id.hex()[:8]} of {self.server.entry.name}: {self.status.name}>"

    @property
    def label(self) -> str:
        return f"{self.server.label} (acceptance)"

    @property
    def status(self) -> GoalStatus:
        """UNKNOWN until the goal is accepted."""
        return self.record.status if self.record is not None else GoalStatus.UNKNOWN

    @property
    def answered(self) -> bool:
        """Whether the server has said its word on the goal."""
        return self.accepted.done()

    def run(self) -> Coroutine[Any, Any, None]:
        return self.server.consider(self)

    def end(self, outcome: Outcome) -> None:
        """Fix the outcome; the first one counts."""
        if self.outcome is not None:
            return
        self.outcome = outcome
        self.server.ended(self, outcome)
        told = self.on_outcome
        self.on_outcome = self.on_feedback = None  # else client and run keep each other alive
        if told is not None:
            told(outcome)
        self.waiters.wake_all()

    def cancel(self, reason: str) -> bool:
        """Begin to cancel: False when it is too late. The body is interrupted where it waits and may clean up."""
        if not self.cancelable or self.record is None:
            return False
        if self.canceling is None:
            self.server.table.cancel(self.goal_id)
            self.interrupt(reason)
        return True

    def interrupt(self, reason: str) -> None:
        """Interrupt the body; a goal that has not begun ends here and now."""
        self.canceling = reason
        self.interrupted = (asyncio.get_running_loop().time(), self.feedback_count)
        self.server.changed()
        if self.task is not None and self.begun:
            self.task.cancel()
        else:
            self.server.forget(self)

    def again(self) -> asyncio.CancelledError | None:
        """The cancellation once more, for a body that gives feedback as if there had been none; None while it may be cleaning up."""
        now = asyncio.get_running_loop().time()
        then, count = self.interrupted
        if now - then < CLEANUP_SECONDS and self.feedback_count - count < CLEANUP_FEEDBACKS:
            return None
        self.interrupted = (now, self.feedback_count)
        return asyncio.CancelledError(self.canceling)

    @property
    def cancelable(self) -> bool:
        """Whether the body has not had its last word yet."""
        return self.outcome is None and self.last is None


class CancelQuestion:
    """Whether a goal may be canceled, as an inbox item: the hook that knows has the node's turn, as all its handlers.

    With a `reason`, the goal is canceled here and now if the hook agrees, whether or not somebody still waits for the answer.
    """

    __slots__ = ("answer", "reason", "run_asked_for", "server")

    def __init__(self, server: ActionServer, run: GoalRun, reason: str | None) -> None:
        self.server = server
        self.run_asked_for = run
        self.reason = reason
        self.answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()

    @property
    def label(self) -> str:
        return f"{self.server.label} (cancel check)"

    async def run(self) -> None:
        hook, goal = self.server.cancels, self.run_asked_for
        assert hook is not None
        agreed = False
        try:
            if goal.cancelable:
                verdict = hook(goal.goal_message)
                agreed = verdict if isinstance(verdict, bool) else await verdict
        except BaseException as error:
            failure = blame(error, self.label)
            if not isinstance(failure, Exception):
                raise
            self.server.node.goal_failed(self.label, failure)
        else:
            if agreed and self.reason is not None:
                agreed = goal.cancel(self.reason)
        finally:
            self.server.questions.pop(self, None)
            if not self.answer.done():
                self.answer.set_result(agreed)


class ActionServer:
    """One node's action: who may run, who waits, and the tasks that run them."""

    __slots__ = (
        "_expiry", "accepts", "action", "arrivals", "arriving", "cancels", "entry", "goals", "handler", "known", "label", "node", "on_change",
        "on_feedback", "questions", "running", "table", "waiting",
    )  # fmt: skip

    def __init__(
        self,
        node: Host,
        entry: ActionEntry,
        action: Action[Any, Any, Any],
        arrivals: ArrivalPolicy,
        result_timeout: float,
        label: str,
    ) -> None:
        self.node = node
        self.entry = entry
        self.action = action
        self.arrivals = arrivals
        self.table = GoalTable(round(result_timeout * 1e9))
        self.known: dict[bytes, GoalRun] = {}
        """The goals in the table, by id."""
        self._expiry: asyncio.TimerHandle | asyncio.Future[bool] | None = None
        """Drops results whose time is over, while results are kept."""
        self.on_change: Callable[[], None] | None = None
        """Called after every change of a goal's status, when somebody listens to the status topic."""
        self.on_feedback: Callable[[bytes, Any], None] | None = None
        """Called with every feedback, when somebody listens to the feedback topic."""
        self.label = label
        self.handler: Callable[[Any], AsyncGenerator[Any, None]]
        self.accepts: Callable[[Any], Awaitable[None] | None] | None = None
        self.cancels: Callable[[Any], Awaitable[bool] | bool] | None = None
        self.running: dict[GoalRun, None] = {}
        self.waiting: deque[GoalRun] = deque()
        self.arriving: dict[GoalRun, None] = {}
        self.questions: dict[CancelQuestion, None] = {}
        self.goals = 0

    def __repr__(self) -> str:
        return f"<server of {self.entry.name} in {self.node.fqn}: {len(self.running)} running, {len(self.waiting)} waiting>"

    def submit(self, run: GoalRun) -> None:
        """Ask for acceptance; `run.accepted` completes with None or `Reject`."""
        self.goals += 1
        self.arriving[run] = None
        self.node.inbox.put_control(run)

    async def consider(self, run: GoalRun) -> None:
        """Accept or reject, in the node's turn: the acceptance hook may read the node's state."""
        if run.accepted.done():  # the client has gone
            self.arriving.pop(run, None)
            return
        try:
            self._expire()
            if run.goal_id in self.table:
                raise Reject(f"goal id {run.goal_id.hex()} is in use already: make a new id for each goal")
            if self.accepts is not None:
                verdict = self.accepts(run.goal_message)
                if verdict is not None:
                    await verdict
            if not run.accepted.done():
                self._make_place()
        except Reject as refusal:
            self._answer(run, refusal)
        except BaseException as error:
            failure = blame(error, self.label)
            if failure is None:
                raise
            self._answer(run, Reject(f"the acceptance check failed: {described(failure)}"))
            if not isinstance(failure, Exception):
                raise
            self.node.goal_failed(self.label, failure)
        else:
            self.arriving.pop(run, None)
            if run.accepted.done():
                return
            run.record = self.table.accept(run.goal_id, self.node.clock.wall_ns())
            self.known[run.goal_id] = run
            self.changed()
            run.accepted.set_result(None)
            self.waiting.append(run)
            self._start_next()

    def cancel(self, run: GoalRun, reason: str) -> Awaitable[bool]:
        """Cancel a goal if the body's owner agrees, also when nobody awaits the answer. It is no when the node ends before that."""
        if self.cancels is None:
            answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
            answer.set_result(run.cancel(reason))
            return answer
        return asyncio.shield(self._ask(run, reason))

    async def allow_cancel(self, run: GoalRun) -> bool:
        """Ask the body's owner whether this goal may be canceled. No, when the node ends before it says so."""
        return self.cancels is None or await asyncio.shield(self._ask(run, None))

    def _ask(self, run: GoalRun, reason: str | None) -> asyncio.Future[bool]:
        """Put the question to the node, in its turn. It is the server's from here on, whatever becomes of who waits for the answer."""
        question = CancelQuestion(self, run, reason)
        self.questions[question] = None
        if self.node.inbox.task is asyncio.current_task():  # it is its turn, and it may wait for the answer
            self.node.spawn(question.run(), name=question.label)
        else:
            self.node.inbox.put_control(question)
        return question.answer

    async def result_of(self, goal_id: bytes) -> tuple[GoalStatus, Any]:
        """Wait for a goal's end: its status and result (None where there is none); UNKNOWN at once for an id that is not known."""
        self._expire()
        run = self.known.get(goal_id)
        if run is None:
            return GoalStatus.UNKNOWN, None
        while run.outcome is None:
            await run.waiters.wait()
        return run.outcome.status, run.outcome.result

    async def cancel_goals(self, goal_id: bytes, stamp_ns: int, reason: str) -> CancelOutcome:
        """A cancel request in one of its four forms (ros2-semantics 6.4); asks `cancels` for each goal it means."""
        self._expire()
        selection = self.table.select(goal_id, stamp_ns)
        runs = [self.known[record.goal_id] for record in selection.candidates]
        asked = [run for run in runs if run.cancelable and await self.allow_cancel(run)]
        agreed = [run.record for run in asked if run.record is not None and run.cancelable]
        outcome = self.table.begin_cancel(selection, agreed)
        for record in outcome.goals:
            self.known[record.goal_id].interrupt(reason)
        return outcome

    def ended(self, run: GoalRun, outcome: Outcome) -> None:
        """Enter the outcome into the table, by legal transitions only."""
        record = run.record
        assert record is not None
        if record.status is GoalStatus.ACCEPTED:  # it never ran: its node ended first
            self.table.execute(record)
        self.table.end(record, _EVENTS[outcome.status], self.node.clock.now_ns(), outcome.result, outcome.reason)
        if self._expiry is None:
            self._expire_later(0)
        self.changed()

    def changed(self) -> None:
        if self.on_change is not None:
            self.on_change()

    def _expire(self) -> None:
        for record in self.table.expire(self.node.clock.now_ns()):
            self.known.pop(record.goal_id, None)

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

    def forget(self, run: GoalRun) -> None:
        """A goal that had not begun has been interrupted."""
        if run in self.waiting:
            self.waiting.remove(run)
        self.running.pop(run, None)
        if run.task is not None:
            run.task.cancel()
        run.end(Outcome(run.verdict, reason=run.canceling or ""))
        self._start_next()

    def stop(self, reason: str) -> list[asyncio.Task[None]]:
        """Interrupt every goal, because the node ends; the returned tasks are still cleaning up."""
        for run in (*self.waiting, *self.running):
            if not run.cancelable:
                assert run.task is not None
                run.task.cancel()  # it had its last word; its outcome stands
            elif run.canceling is None:
                run.verdict = GoalStatus.ABORTED
                run.interrupt(reason)
        return [run.task for run in self.running if run.task is not None]

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """The node has ended: goals that have not ended are aborted, goals that were on their way get `error()`."""
        for run in (*self.waiting, *self.running):
            run.end(Outcome(GoalStatus.ABORTED, reason=str(error())))
        for run in self.arriving:
            if not run.accepted.done():
                run.accepted.set_exception(error())
        for question in self.questions:
            question.answer.set_result(False)
        self.arriving.clear()
        self.questions.clear()
        self.waiting.clear()
        self.running.clear()
        expiry, self._expiry = self._expiry, None
        if expiry is not None:
            expiry.cancel()

    def _make_place(self) -> None:
        policy, size = self.arrivals.policy, self.arrivals.size
        busy = len(self.running) + len(self.waiting)
        if policy == "preempt":
            for other in (*self.waiting, *self.running):
                other.cancel("preempted by a newer goal")
        elif policy == "queue" and len(self.waiting) >= size:
            raise Reject(f"the queue is full: {size} goals wait")
        elif policy == "parallel" and busy >= size:
            raise Reject(f"{size} goals run already")
        elif policy == "reject" and busy:
            raise Reject("another goal is running")

    def _start_next(self) -> None:
        limit = self.arrivals.size if self.arrivals.policy == "parallel" else 1
        while self.waiting and len(self.running) < limit:
            run = self.waiting.popleft()
            self.running[run] = None
            assert run.record is not None
            self.table.execute(run.record)
            self.changed()
            run.task = self.node.spawn(self._drive(run), name=self.label)

    def _answer(self, run: GoalRun, refusal: Reject) -> None:
        self.arriving.pop(run, None)
        if not run.accepted.done():
            run.accepted.set_exception(refusal)

    async def _drive(self, run: GoalRun) -> None:
        """The goal's own task: whatever happens in it ends in exactly one outcome."""
        run.begun = True
        try:
            run.end(await self._work(run))
        except BaseException as error:
            if not self._interrupted(run, error):
                raise
        finally:
            self.running.pop(run, None)
            self._start_next()

    def _interrupted(self, run: GoalRun, error: BaseException) -> bool:
        """End a goal whose body let `error` out; False when the node is being ended, not the goal."""
        failure = blame(error, self.label)
        if isinstance(failure, Reject):
            run.end(Outcome(GoalStatus.ABORTED, reason=failure.reason))
        elif failure is not None:
            self._fail(run, failure)
        elif isinstance(error, Unwinding) or (run.last is None and run.canceling is None):
            run.end(Outcome(GoalStatus.ABORTED, reason=f"{self.node.fqn} ended while the goal ran"))
            return False
        elif run.last is not None:
            run.end(self._outcome(run))
        else:
            run.end(Outcome(run.verdict, reason=run.canceling or ""))
        return True

    def _fail(self, run: GoalRun, error: BaseException) -> None:
        result = run.last.result if run.last is not None else None
        run.end(Outcome(GoalStatus.ABORTED, result, f"{type(error).__name__}: {error}"))
        if isinstance(error, Exception):
            self.node.goal_failed(self.label, error)
        else:
            self.node.fail(error, self.label, decided=True)

    async def _work(self, run: GoalRun) -> Outcome:
        """Step the body to its end."""
        body = self.handler(run.goal_message)
        step: Awaitable[Any] = body.__anext__()
        while True:
            try:
                item = await step
            except StopAsyncIteration:
                return self._outcome(run)
            if (wrong := self._refused(run, item)) is not None:
                run.ignored += 1
                if run.ignored > IGNORED:
                    await body.aclose()
                    raise RuntimeError(
                        f"{self.label} went on after {IGNORED} errors thrown into it; it was closed. The last: {described(wrong)}"
                    )
                step = body.athrow(wrong)
            elif run.last is not None:
                step = body.__anext__()
            else:
                step = await self._feed(run, body, item)

    def _refused(self, run: GoalRun, item: Any) -> BaseException | None:
        """What is wrong with an item; a last item without fault is taken."""
        if run.last is not None:
            return RuntimeError(f"{self.label} yielded again after its last item {run.last!r}")
        if isinstance(item, Done | Aborted):
            last: Done[Any] | Aborted[Any] = item  # pyright: ignore[reportUnknownVariableType]
            if last.result.__class__ is not self.action.result:
                return WrongType(f"{self.label} ends with {self.action.result.__name__}, not {described(last.result)}")
            run.last = last
            run.canceled_at_last = run.canceling is not None
            return None
        if item.__class__ is not self.action.feedback:
            return WrongType(
                f"{self.label} yields {self.action.feedback.__name__}, Done or Aborted, not {described(item)}"
            )
        return run.again() if run.canceling is not None else None

    async def _feed(self, run: GoalRun, body: AsyncGenerator[Any, None], item: Any) -> Awaitable[Any]:
        """Hand a feedback on and give the loop a turn; the next step of the body, or the interruption to throw into it."""
        run.feedback_count += 1
        if run.on_feedback is not None:
            run.on_feedback(item)
        if self.on_feedback is not None:
            self.on_feedback(run.goal_id, item)
        try:
            await asyncio.sleep(0)
        except asyncio.CancelledError as interruption:
            return body.athrow(interruption)
        return body.__anext__()

    def _outcome(self, run: GoalRun) -> Outcome:
        last = run.last
        if isinstance(last, Aborted):
            return Outcome(GoalStatus.ABORTED, last.result, last.reason)
        if last is not None:
            return Outcome(
                run.verdict if run.canceled_at_last else GoalStatus.SUCCEEDED, last.result, run.canceling or ""
            )
        self.node.warn("an action body ended without Done or Aborted", handler=self.label)
        why = "its body ended without a result: end it with `yield Done(result)`"
        if run.canceling is not None:  # conformance case action_status/cancel-then-return-nothing: that is aborted, too
            why = f"{run.canceling}, but {why}, or let the cancellation pass"
        return Outcome(GoalStatus.ABORTED, reason=why)
