"""The execution of goals: one task per goal drives its body, an async generator that yields feedback and ends with `Done` or `Aborted`.

Whatever interrupts the driver between two steps is thrown into the body, so a timeout or task group around a ``yield`` works as usual. A
body is resumed until it ends by itself, and the code after ``yield Done(...)`` runs; it is closed only if it keeps ignoring errors thrown
into it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable
from typing import Any, Final, NamedTuple, Protocol

from actors.actions.goals import GoalRecord, GoalStatus
from actors.actions.peers import CLEANUP_SECONDS, Outcome
from actors.checks import create
from actors.contracts.contracts import Aborted, Action, Done
from actors.errors import Reject, WrongType, described
from actors.inbox.control import NodeExit, blame
from actors.interfaces.message import F, G, R
from actors.services.peers import Caller
from actors.time.clock import Clock

IGNORED: Final = 3
"""The number of errors, cancellations included, thrown into a body that goes on yielding, before it is closed and reported."""

CLEANUP_FEEDBACKS: Final = 1000
"""The number of feedbacks that a canceled body may yield within `CLEANUP_SECONDS` while it cleans up. With one more, it counts as having
ignored the cancellation."""


class Host(Caller, Protocol):
    """What an action server requires of its node."""

    @property
    def clock(self) -> Clock: ...

    def goal_failed(self, action: str, error: Exception, event: str = ...) -> None: ...

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None: ...

    def warn(self, event: str, **fields: object) -> None: ...


class GoalHandlers(NamedTuple):
    """The methods of a node that serve one action."""

    label: str
    """The name of the body in reports."""
    body: Callable[[Any], AsyncGenerator[object, None]]
    accepts: Callable[[Any], Awaitable[None] | None] | None = None
    """Raises `Reject` to refuse a goal."""
    cancels: Callable[[Any], Awaitable[bool] | bool] | None = None
    """Returns whether a goal may be canceled."""


class GoalDriver:
    """Runs the bodies of one action's goals, each to exactly one outcome.

    Invariants:

    * Once the task of a goal runs, `end` is called with an outcome, and then `left`, whatever happens. Only the first outcome counts.
    * Between two steps of a body, the driver awaits only one turn of the loop. An interruption of that turn is thrown into the body.
    """

    __slots__ = ("action", "end", "handlers", "host", "left", "on_feedback")

    def __init__(
        self,
        host: Host,
        action: Action[G, R, F],
        handlers: GoalHandlers,
        end: Callable[[GoalRecord, Outcome], None],
        left: Callable[[], None],
    ) -> None:
        self.host = host
        self.action = action
        self.handlers = handlers
        self.on_feedback: list[Callable[[bytes, Any], None]] = []
        """Called with every feedback and the id of its goal. They must not raise."""
        self.end: Final = end
        """Called with a goal and its outcome."""
        self.left: Final = left
        """Called when the task of a goal ends, so that another goal can start."""

    async def run(self, goal: GoalRecord) -> None:
        """Run a goal to its outcome, in a task of its own."""
        try:
            self.end(goal, await self._work(goal))
        except BaseException as error:
            if not self._interrupted(goal, error):
                raise
        finally:
            self.left()

    def _interrupted(self, goal: GoalRecord, error: BaseException) -> bool:
        """Set the outcome of a goal whose body raised `error`. Returns False if the node is being ended, not only the goal."""
        failure = blame(error, self.handlers.label)
        if isinstance(failure, Reject):
            self.end(goal, create(Outcome, GoalStatus.ABORTED, reason=failure.reason))
        elif failure is not None:
            self._fail(goal, failure)
        elif isinstance(error, NodeExit) or (goal.last is None and goal.interruption is None):
            self.end(goal, create(Outcome, GoalStatus.ABORTED, reason=f"{self.host.fqn} ended while the goal ran"))
            return False
        elif goal.last is not None:
            self.end(goal, self._outcome(goal))
        else:
            self.end(goal, create(Outcome, goal.interrupted_as, reason=goal.interruption or ""))
        return True

    def _fail(self, goal: GoalRecord, error: BaseException) -> None:
        result = goal.last.result if goal.last is not None else None
        self.end(goal, create(Outcome, GoalStatus.ABORTED, result, f"{type(error).__name__}: {error}"))
        if isinstance(error, Exception):
            self.host.goal_failed(self.handlers.label, error)
        else:
            self.host.fail(error, self.handlers.label, decided=True)

    async def _work(self, goal: GoalRecord) -> Outcome:
        """Run the body to its end and return the outcome.

        The body is driven step by step, because ``async for`` can only request the next item. The driver must also be able to raise at a
        ``yield``: an error if the item is wrong, or the cancellation that arrives while the driver waits for its turn. Both have to resume
        the body where it is suspended, inside its own scopes. The next step is therefore an awaitable, made by ``__anext__`` or ``athrow``,
        here or in `_feed`.
        """
        goal.body = body = self.handlers.body(goal.message)
        ignored = 0
        step: Awaitable[object] = body.__anext__()
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

    def _refused(self, goal: GoalRecord, item: object) -> BaseException | None:
        """The error to throw into the body for an item; None if the item is valid. A valid last item is stored."""
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
        """The cancellation to throw again into a body that goes on yielding feedback; None while it may still be cleaning up."""
        now = self.host.inbox.loop.time()
        then, count = goal.interrupted_at
        if now - then < CLEANUP_SECONDS and goal.feedback_count - count < CLEANUP_FEEDBACKS:
            return None
        goal.interrupted_at = (now, goal.feedback_count)
        return asyncio.CancelledError(goal.interruption)

    async def _feed(self, goal: GoalRecord, body: AsyncGenerator[object, None], item: object) -> Awaitable[object]:
        """Send a feedback and give the loop one turn. Returns the body's next step, or the throwing of an interruption into it."""
        goal.feedback_count += 1
        client, observers = goal.client, self.on_feedback
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
            return create(Outcome, GoalStatus.ABORTED, last.result, last.reason)
        if last is not None:
            status = GoalStatus.SUCCEEDED if goal.interruption is None else goal.interrupted_as
            return create(Outcome, status, last.result, goal.interruption or "")
        self.host.warn("an action body ended without Done or Aborted", handler=self.handlers.label)
        why = "its body ended without a result: end it with `yield Done(result)`"
        if goal.interruption is not None:  # a canceled goal whose body returns nothing is aborted, too
            why = f"{goal.interruption}, but {why}, or let the cancellation pass"
        return create(Outcome, GoalStatus.ABORTED, reason=why)
