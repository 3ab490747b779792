"""The requests of a client to an action server, as items of its node's inbox: for the acceptance of a goal and for its cancellation.

Both are decided in the inbox, like all handlers of the node, because the deciding hooks may read the node's state.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from actors.actions.goals import GoalRecord
    from actors.actions.peers import GoalFollower
    from actors.services.peers import Caller


class Considering(Protocol):
    """The server that answers the requests."""

    label: str
    """The name of the body in reports."""

    @property
    def node(self) -> Caller: ...

    @property
    def host(self) -> str: ...

    def consider(self, request: GoalRequest) -> Coroutine[Any, Any, None]: ...

    def consider_cancel(self, request: CancelRequest) -> Coroutine[Any, Any, None]: ...


class GoalRequest:
    """A request to accept a goal.

    Invariant: `future` is completed once: with the time of acceptance (nanoseconds), with `Reject`, or with the error that describes the
    end of the node. A client that gives up cancels it.
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
        """Whether the server has answered or the client has given up."""
        return self.future.done()

    def run(self) -> Coroutine[Any, Any, None]:
        return self.server.consider(self)

    def fail(self, error: Exception) -> None:
        """Give the client `error`, unless the request has been answered."""
        if not self.future.done():
            self.future.set_exception(error)


class CancelRequest:
    """A question to the hook that decides whether a goal may be canceled.

    If `reason` is given, the goal is canceled as soon as the hook agrees, even if nobody awaits the answer any more.

    Invariant: `future` is completed once, with the answer. A node that ends before it answers counts as having refused.
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
        """Complete the future, unless it is already completed."""
        if not self.future.done():
            self.future.set_result(agreed)

    def fail(self, error: Exception) -> None:
        """Answer False, because the node has ended."""
        self.answer(False)
