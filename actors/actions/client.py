"""Action clients: a goal as an object that is entered, iterated over for feedback, and awaited for its result."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Generator
from types import TracebackType
from typing import Final, Generic, NamedTuple, Protocol, cast

from actors.actions.goals import GoalStatus
from actors.actions.peers import CLEANUP_SECONDS, ActionPeer, GoalFollower, Outcome
from actors.checks import NoPublicConstructor
from actors.contracts.contracts import Action
from actors.errors import ActionUnavailable, GoalAborted, GoalCanceled, GoalRejected, NotStarted, Reject, WrongType
from actors.inbox.boundary import asked
from actors.interfaces.message import F, G, Message, R
from actors.services.peers import Caller, OpenCall, ServedName, refuse_cycle, refuse_other_type
from actors.waiting import Waiters

FEEDBACK_DEPTH = 10
"""The number of feedbacks that a client keeps. A slow reader loses the oldest, and the loss is counted."""


class Starter(Caller, Protocol):
    """What a goal requires of the node that starts it."""

    def new_id(self) -> bytes: ...


class SentGoals(NamedTuple):
    """The functions that send a goal to its server. Interceptors replace some of them by their own."""

    submit: Callable[[ActionPeer, bytes, Message, GoalFollower], OpenCall]
    """Sends the request to a server; else as `ActionPeer.submit`."""
    cancel: Callable[[ActionPeer, bytes, str], Awaitable[bool]]
    """Sends a cancellation to a server; else as `ActionPeer.cancel`."""


class Following(Generic[F]):
    """The client's half of one goal: the status, feedback and result that the server has sent.

    Invariants:

    * It only follows the goal. The server's half calls `on_status`, `on_feedback` and `on_result`, in the order of the events.
    * `outcome` is set once, together with the final status. Nothing changes after that.
    * `feedback` holds at most the newest `FEEDBACK_DEPTH` feedbacks that have not been taken. `dropped` counts those that were lost.
    * A task that waits in `changed` is woken by the next feedback and by the end.
    """

    __slots__ = ("changed", "dropped", "feedback", "feedback_count", "goal_id", "outcome", "owner", "server", "status")

    def __init__(self, server: ActionPeer, goal_id: bytes, owner: str) -> None:
        self.server: Final = server
        self.goal_id: Final = goal_id
        self.owner: Final = owner
        self.status = GoalStatus.UNKNOWN
        self.outcome: Outcome | None = None
        self.feedback: deque[F] = deque()
        self.feedback_count = 0
        self.dropped = 0
        self.changed = Waiters()

    def on_status(self, status: GoalStatus) -> None:
        self.status = status

    def on_feedback(self, feedback: F) -> None:
        self.feedback_count += 1
        if len(self.feedback) >= FEEDBACK_DEPTH:
            self.feedback.popleft()
            self.dropped += 1
        self.feedback.append(feedback)
        if self.changed:
            self.changed.wake_all()

    def on_result(self, outcome: Outcome) -> None:
        self.status = outcome.status
        self.outcome = outcome
        self.changed.wake_all()


class Goal(Generic[R, F], metaclass=NoPublicConstructor):
    """One goal, from the side of its client::

        async with self.send_goal(MOVE, MoveToPosition.Goal(target_x=3.0)) as goal:
            async for feedback in goal: ...
            result = await goal

    Entering the block sends the goal, unless it has been sent, and waits until it is accepted. Raises `GoalRejected` or `ActionUnavailable`
    if it is not. Leaving the block cancels a goal that is still active and waits until its body has cleaned up, for a limited time.
    Awaiting the goal returns its result, or raises `GoalCanceled` or `GoalAborted` with `.result` and `.reason`; it may be awaited
    repeatedly and by several tasks. A goal that has succeeded in another process which did not keep the result until it could be fetched
    raises `GoalAborted`, too, because there is nothing to return; `ended` gives its true status.

    It has no public constructor: `Node.send_goal` gives one.
    """

    # Invariant: `_sent` is None until a server has accepted the goal. From then on it is always the same object.

    __slots__ = ("_action", "_entry", "_message", "_node", "_sent", "_timeout", "_ways")

    def __init__(
        self,
        node: Starter,
        entry: ServedName[ActionPeer],
        action: Action[G, R, F],
        message: G,
        timeout: float,
        ways: SentGoals,
    ) -> None:
        if message.__class__ is not action.goal:
            raise WrongType(f"{entry.name} takes {action.goal.__name__}, not {type(message).__name__} {message!r:.60}")
        self._node = node
        self._entry = entry
        self._action = action
        self._message = message
        self._timeout = timeout
        self._ways = ways
        self._sent: Following[F] | None = None

    def __repr__(self) -> str:
        return f"<goal {self.goal_id.hex()[:8] or 'not sent'} for {self._entry.name}: {self.status.name}>"

    @property
    def goal_id(self) -> bytes:
        """The goal's 16-byte id; empty until it is accepted."""
        return self._sent.goal_id if self._sent is not None else b""

    @property
    def status(self) -> GoalStatus:
        """The goal's status; UNKNOWN until it is accepted."""
        return self._sent.status if self._sent is not None else GoalStatus.UNKNOWN

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return self._sent is not None and self._sent.outcome is not None

    @property
    def feedback_count(self) -> int:
        """The number of feedbacks received."""
        return self._sent.feedback_count if self._sent is not None else 0

    @property
    def dropped(self) -> int:
        """The number of feedbacks lost because they were not taken in time."""
        return self._sent.dropped if self._sent is not None else 0

    async def send(self) -> None:
        """Send the goal and wait until it is accepted, as entering the block does. Raises `GoalRejected` or `ActionUnavailable`."""
        if self._sent is not None:
            raise RuntimeError(f"{self!r} has been sent already: start another goal")
        self._node.check_thread()
        try:
            async with asyncio.timeout(self._timeout):
                self._sent = await self._accepted()
        except Reject as refusal:
            raise GoalRejected(self._entry.name, refusal.reason) from None
        except TimeoutError:
            raise ActionUnavailable(self._unanswered()) from None

    def _unanswered(self) -> str:
        """The text of the error for a goal that was neither accepted nor rejected in time."""
        if self._entry.server is not None:
            return asked(self._entry.server.unanswered, self._timeout)
        return (
            f"nobody accepted or rejected a goal of {self._entry.name} within {self._timeout:g} s: start the action's node, or check the name "
            f"and namespace{self._entry.meant()}"
        )

    async def cancel(self, reason: str = "canceled by its client") -> bool:
        """Ask the server to cancel the goal. True if it has begun to; False if the goal has ended or the server refuses."""
        sent = self._sent
        if sent is None:
            raise NotStarted(f"{self!r}: there is nothing to cancel")
        self._node.check_thread()
        return sent.outcome is None and await self._ask_cancel(sent, reason)

    async def ended(self) -> Outcome:
        """Wait for the goal's end and return its outcome. Does not raise if the goal failed; raises `NotStarted` before it is accepted."""
        sent = self._sent
        if sent is None:
            raise NotStarted(f"{self!r}: enter it with `async with` first")
        while sent.outcome is None:
            await sent.changed.wait()
        return sent.outcome

    async def __aenter__(self) -> Goal[R, F]:
        if self._sent is None:
            await self.send()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.done:
            return
        try:
            # The limit includes the wait for the server's answer: its hook, or its node, may hang.
            async with asyncio.timeout(CLEANUP_SECONDS):
                if await self.cancel("its client left the goal's block"):
                    await self.ended()
        except TimeoutError:
            pass  # the server is left to clean up alone; the stop of its node limits that

    def __aiter__(self) -> Goal[R, F]:
        return self

    async def __anext__(self) -> F:
        sent = self._sent
        if sent is None:
            raise NotStarted(f"{self!r}: enter it with `async with` first")
        while not sent.feedback:
            if sent.outcome is not None:
                raise StopAsyncIteration
            await sent.changed.wait()
        return sent.feedback.popleft()

    def __await__(self) -> Generator[object, None, R]:
        return self._result().__await__()

    async def _result(self) -> R:
        outcome = await self.ended()
        if outcome.status is GoalStatus.SUCCEEDED and outcome.result is not None:
            return cast("R", outcome.result)
        failure = GoalCanceled if outcome.status is GoalStatus.CANCELED else GoalAborted
        raise failure(self._entry.name, outcome.reason, outcome.result)

    def _ask_cancel(self, sent: Following[F], reason: str) -> Awaitable[bool]:
        return self._ways.cancel(sent.server, sent.goal_id, reason)

    async def _accepted(self) -> Following[F]:
        """Find the server, submit the goal, and wait until it is accepted. Raises `Reject` if it is rejected."""
        entry, node = self._entry, self._node
        server = entry.server or await entry.require()
        refuse_other_type(entry.name, server.host, server.type, node, self._action.type)
        exclusive = node.inbox.task is asyncio.current_task()
        if exclusive:
            refuse_cycle(node, server.node)
        sent: Following[F] = Following(server, node.new_id(), node.fqn)
        request = self._ways.submit(server, sent.goal_id, self._message, sent)
        if exclusive:
            node.waits_for = request
        try:
            await request.future
        except asyncio.CancelledError:
            if not request.future.cancelled() and request.future.exception() is None:
                # The goal was accepted just before this task was canceled, so nobody else will cancel it.
                self._ask_cancel(sent, "its client was canceled")
            raise
        finally:
            if exclusive:
                node.waits_for = None
        return sent


def _submit(server: ActionPeer, goal_id: bytes, message: Message, client: GoalFollower) -> OpenCall:
    return server.submit(goal_id, message, client)


def _cancel(server: ActionPeer, goal_id: bytes, reason: str) -> Awaitable[bool]:
    return server.cancel(goal_id, reason)


DIRECT: Final = SentGoals(_submit, _cancel)
"""The functions without interceptors."""
