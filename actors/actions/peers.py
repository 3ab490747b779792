"""The Protocols between the two halves of a goal.

The client's half (`actors.actions.client.Goal`) follows the goal by messages; the server's half (`actors.actions.server.ActionServer`) owns
its state. Within one process a message is a method call; a stand-in for a server or client of another process encodes it. The messages are
those of ROS 2: the goal request and its answer, the status, the feedback, the result, and the cancel request and its answer. ROS 2 has no
field for a reason, which a stand-in may therefore drop.
"""

from __future__ import annotations

from collections.abc import Awaitable
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.checks import NoPublicConstructor
from actors.services.peers import Answering, OpenCall

if TYPE_CHECKING:
    from actors.actions.goals import GoalStatus
    from actors.interfaces.message import Message

CLEANUP_SECONDS: Final = 5.0
"""How long, in seconds, a canceled body may go on yielding feedback while it cleans up, and how long a client that leaves its goal's block
waits for that."""


class Outcome(metaclass=NoPublicConstructor):
    """How a goal ended: its terminal status, the result from its body (or None), and the reason.

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
    """The client's half of one goal, as seen by a server.

    The methods are called in the order of the events, beginning with the acceptance. They must not raise.
    """

    @property
    def owner(self) -> str:
        """The fully qualified name of the node that has sent the goal."""
        ...

    def on_status(self, status: GoalStatus) -> None:
        """Called when the status has changed to one that is not terminal."""
        ...

    def on_feedback(self, feedback: Any) -> None:
        """Called when the body has yielded a feedback."""
        ...

    def on_result(self, outcome: Outcome) -> None:
        """Called when the goal has ended. No call follows."""
        ...


class ActionPeer(Answering, Protocol):
    """What a goal requires of a server of its action, in this process or another."""

    @property
    def type(self) -> type[Any]:
        """The action type that it serves. Goals of another type are refused."""
        ...

    @property
    def goals(self) -> int:
        """The number of goals that have been requested of it in this process."""
        ...

    @property
    def active(self) -> int:
        """The number of them that have been accepted and have not ended."""
        ...

    def submit(self, goal_id: bytes, message: Message, client: GoalFollower | None) -> OpenCall:
        """Request the acceptance of a goal, and let `client` follow it. Never blocks.

        The future of the returned request is completed with the time of acceptance (nanoseconds on the server's clock), with `Reject`, or
        with the error that describes the end of the server. If it is canceled first, the goal is not accepted; a server of another process
        cancels a goal that it has accepted meanwhile.
        """
        ...

    def cancel(self, goal_id: bytes, reason: str) -> Awaitable[bool]:
        """Request the cancellation of a goal, even if nobody awaits the answer. True if its body has been told to end.

        False if the goal has ended or yielded its last item, if the server refuses, or if its node ends before it answers.
        """
        ...

    def unanswered(self, seconds: float) -> str:
        """The text of the error for a goal that got no answer within `seconds`: the cause and the remedy."""
        ...
