"""One task per goal drives its body, an async generator that yields feedback and ends with `Done` or `Aborted`.

Whatever interrupts the driver between two steps is thrown into the body, so timeouts and task groups around a ``yield`` are safe.
A body is resumed to its end, never closed inside its scopes; the code after its ``yield Done(...)`` runs.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from actors.actions.goals import GoalStatus
from actors.actions.peers import CLEANUP_SECONDS, Outcome
from actors.contracts.contracts import Aborted, Done
from actors.errors import Reject, WrongType, described
from actors.inbox.control import Unwinding, blame
from actors.services.peers import Caller

if TYPE_CHECKING:
    from actors.actions.goals import GoalRecord
    from actors.contracts.contracts import Action
    from actors.time.clock import Clock

__all__ = ["GoalDriver", "GoalHandlers", "GoalObservers", "Host"]

IGNORED: Final = 3
"""A body that goes on yielding after so many cancellations or other errors thrown into it is closed and reported."""

CLEANUP_FEEDBACKS: Final = 1000
"""A canceled body may give so many feedbacks within `CLEANUP_SECONDS` while it cleans up; then it is taken to have ignored the
cancellation."""


class Host(Caller, Protocol):
    """What an action server asks of its node."""

    @property
    def clock(self) -> Clock: ...

    def goal_failed(self, action: str, error: Exception) -> None: ...

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None: ...

    def warn(self, event: str, **fields: object) -> None: ...


class GoalHandlers(NamedTuple):
    """The methods of a node that serve one action."""

    label: str
    """The body's name in reports."""
    body: Callable[[Any], AsyncGenerator[Any, None]]
    accepts: Callable[[Any], Awaitable[None] | None] | None = None
    """Raises `Reject` for a goal that it does not want."""
    cancels: Callable[[Any], Awaitable[bool] | bool] | None = None
    """Whether a goal may be canceled."""


class GoalObservers:
    """Those besides the clients that are told of an action's goals: they publish its status and feedback topics. They must not raise."""

    __slots__ = ("feedback", "status")

    def __init__(self) -> None:
        self.status: list[Callable[[], None]] = []
        """Called after every change of a goal's status."""
        self.feedback: list[Callable[[bytes, Any], None]] = []
        """Called with every feedback and the id of its goal."""


class GoalDriver:
    """Steps the bodies of one action's goals, each to exactly one outcome.

    Invariants:

    * Whatever happens in the task that runs a goal, `end` is called with its outcome, and then `left`. The first outcome counts.
    * Between two steps of a body its driver awaits nothing but one turn of the loop, and an interruption of that is thrown into the body.
    """

    __slots__ = ("action", "end", "handlers", "host", "left", "observers")

    def __init__(
        self,
        host: Host,
        action: Action[Any, Any, Any],
        handlers: GoalHandlers,
        observers: GoalObservers,
        end: Callable[[GoalRecord, Outcome], None],
        left: Callable[[], None],
    ) -> None:
        self.host = host
        self.action = action
        self.handlers = handlers
        self.observers = observers
        self.end: Final = end
        """Takes the outcome of a goal."""
        self.left: Final = left
        """Called when a goal's task has come to its end, so that another goal may have its place."""

    async def run(self, goal: GoalRecord) -> None:
        """The goal's own task."""
        try:
            self.end(goal, await self._work(goal))
        except BaseException as error:
            if not self._interrupted(goal, error):
                raise
        finally:
            self.left()

    def _interrupted(self, goal: GoalRecord, error: BaseException) -> bool:
        """End a goal whose body let `error` out; False when the node is being ended, not the goal."""
        failure = blame(error, self.handlers.label)
        if isinstance(failure, Reject):
            self.end(goal, Outcome(GoalStatus.ABORTED, reason=failure.reason))
        elif failure is not None:
            self._fail(goal, failure)
        elif isinstance(error, Unwinding) or (goal.last is None and goal.interruption is None):
            self.end(goal, Outcome(GoalStatus.ABORTED, reason=f"{self.host.fqn} ended while the goal ran"))
            return False
        elif goal.last is not None:
            self.end(goal, self._outcome(goal))
        else:
            self.end(goal, Outcome(goal.interrupted_as, reason=goal.interruption or ""))
        return True

    def _fail(self, goal: GoalRecord, error: BaseException) -> None:
        result = goal.last.result if goal.last is not None else None
        self.end(goal, Outcome(GoalStatus.ABORTED, result, f"{type(error).__name__}: {error}"))
        if isinstance(error, Exception):
            self.host.goal_failed(self.handlers.label, error)
        else:
            self.host.fail(error, self.handlers.label, decided=True)

    async def _work(self, goal: GoalRecord) -> Outcome:
        """Step the body to its end.

        ``async for`` would do for bodies that behave, but it can only ask for the next item. An item that is wrong is answered by an error
        at its ``yield``, and a cancellation that comes while the driver waits for its turn by that cancellation. Both resume the body where
        it stands, in its own scopes: so the next step is an awaitable, made here or in `_feed` by ``__anext__`` or ``athrow``.
        """
        goal.body = body = self.handlers.body(goal.message)
        ignored = 0
        step: Awaitable[Any] = body.__anext__()
        while True:
            try:
                item = await step
            except StopAsyncIteration:
                return self._outcome(goal)
            if (wrong := self._refused(goal, item)) is not None:
                ignored += 1
                if ignored > IGNORED:
                    await body.aclose()
                    raise RuntimeError(
                        f"{self.handlers.label} went on after {IGNORED} errors thrown into it; it was closed. "
                        f"The last: {described(wrong)}"
                    )
                step = body.athrow(wrong)
            elif goal.last is not None:
                step = body.__anext__()
            else:
                step = await self._feed(goal, body, item)

    def _refused(self, goal: GoalRecord, item: Any) -> BaseException | None:
        """What is wrong with an item; a last item without fault is taken."""
        if goal.last is not None:
            return RuntimeError(f"{self.handlers.label} yielded again after its last item {goal.last!r}")
        if isinstance(item, Done | Aborted):
            last: Done[Any] | Aborted[Any] = item  # pyright: ignore[reportUnknownVariableType]
            if last.result.__class__ is not self.action.result:
                return WrongType(
                    f"{self.handlers.label} ends with {self.action.result.__name__}, not {described(last.result)}"
                )
            goal.last = last
            return None
        if item.__class__ is not self.action.feedback:
            return WrongType(
                f"{self.handlers.label} yields {self.action.feedback.__name__}, Done or Aborted, not {described(item)}"
            )
        return self._again(goal) if goal.interruption is not None else None

    def _again(self, goal: GoalRecord) -> asyncio.CancelledError | None:
        """The cancellation once more, for a body that gives feedback as if there had been none; None while it may be cleaning up."""
        now = self.host.inbox.loop.time()
        then, count = goal.interrupted_at
        if now - then < CLEANUP_SECONDS and goal.feedback_count - count < CLEANUP_FEEDBACKS:
            return None
        goal.interrupted_at = (now, goal.feedback_count)
        return asyncio.CancelledError(goal.interruption)

    async def _feed(self, goal: GoalRecord, body: AsyncGenerator[Any, None], item: Any) -> Awaitable[Any]:
        """Hand a feedback on and give the loop a turn; the next step of the body, or the interruption to throw into it."""
        goal.feedback_count += 1
        client, observers = goal.client, self.observers.feedback
        if client is not None:
            client.on_feedback(item)
        if observers:
            for observer in observers:
                observer(goal.goal_id, item)
        try:
            await asyncio.sleep(0)
        except asyncio.CancelledError as interruption:
            return body.athrow(interruption)
        return body.__anext__()

    def _outcome(self, goal: GoalRecord) -> Outcome:
        """The outcome of a goal whose body has ended by itself."""
        last = goal.last
        if isinstance(last, Aborted):
            return Outcome(GoalStatus.ABORTED, last.result, last.reason)
        if last is not None:
            status = GoalStatus.SUCCEEDED if goal.interruption is None else goal.interrupted_as
            return Outcome(status, last.result, goal.interruption or "")
        self.host.warn("an action body ended without Done or Aborted", handler=self.handlers.label)
        why = "its body ended without a result: end it with `yield Done(result)`"
        if (
            goal.interruption is not None
        ):  # conformance case action_status/cancel-then-return-nothing: that is aborted, too
            why = f"{goal.interruption}, but {why}, or let the cancellation pass"
        return Outcome(GoalStatus.ABORTED, reason=why)
