"""What the two halves of a goal say to each other: the seams of this room.

The client's half (`actors.actions.client.Goal`) follows the goal by messages, the server's half (`actors.actions.server.ActionServer`)
owns its state. In one process a message is a method call; a stand-in for a server or a client elsewhere encodes it. The messages are those
of ROS 2: the goal request and its answer, the status, the feedback, the result, and the cancel request and its answer. A reason, which
ROS 2 has no field for, may get lost on the way.
"""

from __future__ import annotations

from collections.abc import Awaitable
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.services.peers import Answering, OpenCall

if TYPE_CHECKING:
    from actors.actions.goals import GoalStatus

__all__ = ["CLEANUP_SECONDS", "ActionPeer", "GoalFollower", "Outcome"]

CLEANUP_SECONDS: Final = 5.0
"""For how long a canceled body may go on giving feedback while it cleans up, and for how long a client that leaves its goal's block waits
for that."""


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


class GoalFollower(Protocol):
    """The client's half of one goal, as a server sees it.

    It is told of what happens in the order in which it happens, from the acceptance on. It must not raise.
    """

    def on_status(self, status: GoalStatus) -> None:
        """The goal has got another status, which is not the last one."""
        ...

    def on_feedback(self, feedback: Any) -> None:
        """The body has given this feedback."""
        ...

    def on_result(self, outcome: Outcome) -> None:
        """The goal has ended. Nothing follows."""
        ...


class ActionPeer(Answering, Protocol):
    """What a goal asks of a server of its action, here or elsewhere."""

    @property
    def type(self) -> type[Any]:
        """The action type that it serves; a goal of another one is refused."""
        ...

    def submit(self, goal_id: bytes, message: Any, client: GoalFollower | None) -> OpenCall:
        """Ask for the acceptance of a goal, and let `client` follow it. Never blocks.

        The call's future is completed with the time of acceptance (nanoseconds on the server's clock), or with `Reject`, or with what became
        of the server. When it is canceled before, the goal is not accepted; a server elsewhere cancels it if it is accepted all the same.
        """
        ...

    def cancel(self, goal_id: bytes, reason: str) -> Awaitable[bool]:
        """Ask to cancel a goal, also if nobody awaits the answer: True when its body has been told to end.

        False when the goal has ended, or has had its last word, or the server refuses, or its node ends before it says so.
        """
        ...

    def unanswered(self, seconds: float) -> str:
        """Why a goal got no answer in so many seconds, and what to do: the text of an error."""
        ...
