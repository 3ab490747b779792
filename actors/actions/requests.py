"""What a client asks of an action server, as items of its node's inbox: the acceptance of a goal, and its cancellation.

Both are considered in the node's turn, as all its handlers: the hooks that decide may read the node's state.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from actors.actions.goals import GoalRecord
    from actors.actions.peers import GoalFollower
    from actors.services.peers import Caller

__all__ = ["CancelRequest", "Considering", "GoalRequest"]


class Considering(Protocol):
    """The server that answers the requests."""

    label: str
    """The body's name in reports."""

    @property
    def node(self) -> Caller: ...

    @property
    def host(self) -> str: ...

    def consider(self, request: GoalRequest) -> Coroutine[Any, Any, None]: ...

    def consider_cancel(self, request: CancelRequest) -> Coroutine[Any, Any, None]: ...


class GoalRequest:
    """A goal on its way: whether it is accepted.

    Invariant: `future` is completed once, with the time of acceptance (nanoseconds), with `Reject`, or with what became of the node;
    unless the client cancels it because it has gone.
    """

    __slots__ = ("client", "future", "goal_id", "message", "server")

    def __init__(self, server: Considering, goal_id: bytes, message: Any, client: GoalFollower | None) -> None:
        self.server = server
        self.goal_id = goal_id
        self.message = message
        self.client = client
        self.future: asyncio.Future[int] = server.node.inbox.loop.create_future()

    @property
    def label(self) -> str:
        return f"{self.server.label} (acceptance)"

    @property
    def answered(self) -> bool:
        """Whether the server has answered, or the client has gone."""
        return self.future.done()

    def run(self) -> Coroutine[Any, Any, None]:
        return self.server.consider(self)

    def fail(self, error: Exception) -> None:
        """The goal is not accepted, for this reason; unless the client has gone."""
        if not self.future.done():
            self.future.set_exception(error)


class CancelRequest:
    """A question to the hook that knows whether a goal may be canceled.

    With a `reason`, the goal is canceled as soon as the hook agrees, whether or not somebody still waits for the answer.

    Invariant: `future` is completed once, with the answer; a node that ends before it answers has refused.
    """

    __slots__ = ("future", "goal", "reason", "server")

    def __init__(self, server: Considering, goal: GoalRecord, reason: str | None) -> None:
        self.server = server
        self.goal = goal
        self.reason = reason
        self.future: asyncio.Future[bool] = server.node.inbox.loop.create_future()

    @property
    def label(self) -> str:
        return f"{self.server.label} (cancel check)"

    def run(self) -> Coroutine[Any, Any, None]:
        return self.server.consider_cancel(self)

    def answer(self, agreed: bool) -> None:
        """Complete the future, unless that has been done."""
        if not self.future.done():
            self.future.set_result(agreed)

    def fail(self, error: Exception) -> None:
        """The node has ended: that is a no."""
        self.answer(False)
