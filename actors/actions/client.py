"""The asking side of actions: a goal as an object to enter, to iterate for feedback and to await for its result."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Generator
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, cast

from actors.actions.goals import GoalStatus
from actors.actions.server import CLEANUP_SECONDS, GoalRun, Outcome
from actors.errors import (
    ActionUnavailable,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    NotStarted,
    Reject,
    WrongType,
)
from actors.services.services import Caller, refuse_cycle, refuse_other_type
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.contracts.contracts import Action
    from actors.graph.graph import ActionEntry
    from actors.interfaces.message import Message

__all__ = ["FEEDBACK_DEPTH", "Goal"]

G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")

FEEDBACK_DEPTH = 10
"""Feedback is KEEP_LAST 10 for each client: a slow reader loses the oldest, and the loss is counted."""


class Starter(Caller, Protocol):
    """What a goal asks of the node that starts it."""

    def new_id(self) -> bytes: ...


class Goal(Generic[R, F]):
    """One goal as its client sees it::

        async with self.start(MOVE, MoveToPosition.Goal(target_x=3.0)) as goal:
            async for feedback in goal: ...
            result = await goal

    Entering sends the goal, unless it has been sent, and waits for its acceptance (`GoalRejected`, `ActionUnavailable`). Leaving the
    block cancels a goal that still runs and waits for its clean-up. Awaiting gives the result or raises `GoalCanceled` or `GoalAborted`, which carry `.result`
    and `.reason`; it may be awaited again, and by several tasks.

    It has no public constructor: `Node.start` gives one.
    """

    __slots__ = (
        "_action",
        "_changed",
        "_entry",
        "_feedback",
        "_message",
        "_node",
        "_run",
        "_timeout",
        "dropped",
        "feedback_count",
    )

    def __init__(self, node: Starter, entry: ActionEntry, action: Action[G, R, F], message: G, timeout: float) -> None:
        if message.__class__ is not action.goal:
            raise WrongType(f"{entry.name} takes {action.goal.__name__}, not {type(message).__name__} {message!r:.60}")
        self._node = node
        self._entry = entry
        self._action = action
        self._message = message
        self._timeout = timeout
        self._run: GoalRun | None = None
        self._feedback: deque[F] = deque()
        self._changed = Waiters()
        self.feedback_count = 0
        self.dropped = 0

    def __repr__(self) -> str:
        return (
            f"<goal {self.goal_id.hex()[:8] if self._run else 'not sent'} for {self._entry.name}: {self.status.name}>"
        )

    @property
    def goal_id(self) -> bytes:
        """The goal's 16-byte id; empty before it is sent."""
        return self._run.goal_id if self._run is not None else b""

    @property
    def status(self) -> GoalStatus:
        """Where the goal stands now; UNKNOWN before it is accepted."""
        return self._run.status if self._run is not None else GoalStatus.UNKNOWN

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return self._run is not None and self._run.outcome is not None

    async def send(self) -> None:
        """Send the goal and wait for the server's word: what entering the block does."""
        if self._run is not None:
            raise RuntimeError(f"{self!r} has been sent already: start another goal")
        self._node.check_thread()
        try:
            async with asyncio.timeout(self._timeout):
                await self._send()
        except Reject as refusal:
            raise GoalRejected(self._entry.name, refusal.reason) from None
        except TimeoutError:
            raise ActionUnavailable(self._unanswered()) from None

    def _unanswered(self) -> str:
        """Why nobody has accepted or rejected the goal in time."""
        name, server = self._entry.name, self._entry.server
        if server is None:
            return (
                f"nobody accepted or rejected a goal of {name} within {self._timeout:g} s: start the action's node, or check the name "
                "and namespace"
            )
        busy = server.node.inbox.current
        work = f"busy with {busy.label}" if busy is not None else "not ready"
        return (
            f"{server.node.fqn}, which serves {name}, neither accepted nor rejected the goal within {self._timeout:g} s: it is {work}; "
            "declare a handler that waits concurrent=n, or give the goal more time"
        )

    async def cancel(self, reason: str = "canceled by its client") -> bool:
        """Ask the server to cancel. True when it began to; False when the goal has ended or the server refuses."""
        run = self._run
        if run is None:
            raise NotStarted(f"{self!r}: there is nothing to cancel")
        self._node.check_thread()
        if run.canceling is not None:
            return run.outcome is None
        return run.cancelable and await run.server.cancel(run, reason)

    async def ended(self) -> Outcome:
        """Wait for the end and give it as a value: never raises for a goal that failed."""
        run = self._run
        if run is None:
            raise NotStarted(f"{self!r}: enter it with `async with` first")
        while run.outcome is None:
            await self._changed.wait()
        return run.outcome

    async def __aenter__(self) -> Goal[R, F]:
        if self._run is None:
            await self.send()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.done:
            return
        try:
            async with asyncio.timeout(CLEANUP_SECONDS):  # also for the server's word: its hook, or its node, may hang
                if await self.cancel("its client left the goal's block"):
                    await self.ended()
        except TimeoutError:
            pass  # the server's own business from here on; its node's stop bounds it

    def __aiter__(self) -> Goal[R, F]:
        return self

    async def __anext__(self) -> F:
        while not self._feedback:
            if self._run is None:
                raise NotStarted(f"{self!r}: enter it with `async with` first")
            if self._run.outcome is not None:
                raise StopAsyncIteration
            await self._changed.wait()
        return self._feedback.popleft()

    def __await__(self) -> Generator[Any, None, R]:
        return self._result().__await__()

    async def _result(self) -> R:
        outcome = await self.ended()
        if outcome.status is GoalStatus.SUCCEEDED:
            return cast("R", outcome.result)
        failure = GoalCanceled if outcome.status is GoalStatus.CANCELED else GoalAborted
        raise failure(self._entry.name, outcome.reason, outcome.result)

    async def _send(self) -> None:
        entry = self._entry
        server = entry.server or await entry.require()
        refuse_other_type(entry.name, server.node, server.action.type, self._node, self._action.type)
        run = GoalRun(server, self._node.new_id(), self._message)
        run.on_feedback = self._on_feedback
        run.on_outcome = self._on_outcome
        node, host = self._node, server.node
        holding = node.inbox.task is asyncio.current_task()
        if holding:
            refuse_cycle(node, host)
            node.waits_for = run
        server.submit(run)
        try:
            await run.accepted
        except asyncio.CancelledError:
            if (
                not run.accepted.cancelled() and run.accepted.exception() is None
            ):  # accepted in this very moment, and nobody looks after it
                run.server.cancel(run, "its client was canceled")
            raise
        finally:
            if holding:
                node.waits_for = None
        self._run = run

    def _on_feedback(self, feedback: F) -> None:
        self.feedback_count += 1
        if len(self._feedback) >= FEEDBACK_DEPTH:
            self._feedback.popleft()
            self.dropped += 1
        self._feedback.append(feedback)
        self._notify()

    def _on_outcome(self, outcome: Outcome) -> None:
        self._notify()

    def _notify(self) -> None:
        if self._changed:
            self._changed.wake_all()
