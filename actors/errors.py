"""Every error a user of `actors` can meet. Each one says what happened, where, and what to do next."""

from __future__ import annotations

from actors.suggest import did_you_mean

__all__ = [
    "ActionUnavailable",
    "ActorError",
    "CallCycle",
    "CallTimeout",
    "DeclarationError",
    "Ended",
    "GoalAborted",
    "GoalCanceled",
    "GoalFailed",
    "GoalRejected",
    "NodeRestarting",
    "NotRunning",
    "NotStarted",
    "ProgramExit",
    "Reject",
    "ServiceFailed",
    "ServiceUnavailable",
    "WrongThread",
    "WrongType",
]


def described(value: object) -> str:
    """A value or an error in a sentence: its type and its text, the text of a value kept short."""
    return (
        f"{type(value).__name__}: {value}{_meant(value)}"
        if isinstance(value, BaseException)
        else f"{type(value).__name__} {value!r:.60}"
    )


def _meant(error: BaseException) -> str:
    """``; did you mean 'speed'?`` for an attribute that is missing where one of nearly that name is not."""
    if type(error) is not AttributeError or not error.name:
        return ""
    try:
        known = [name for name in dir(error.obj) if name.startswith("_") <= error.name.startswith("_")]
    except Exception:  # an object that does not even say what it has
        return ""
    return did_you_mean(error.name, known)


class ActorError(Exception):
    """Base of all errors that `actors` raises about the running system."""


class DeclarationError(TypeError):
    """A node class, a contract or a tree is declared wrongly. Raised when the class or object is made, never at message 1000."""


class NotStarted(ActorError):
    """A node, a system or a part of one was used before it was started."""


class Ended(ActorError):
    """A node, or a part of one, was used after its end. It does not come back; a restarted node is another incarnation."""


class WrongType(ActorError, TypeError):
    """A message, request, goal or reply is not of its contract's type."""


class WrongThread(ActorError):
    """A node was used from a thread other than its event loop's. Use `node.threadsafe`."""


class ServiceUnavailable(ActorError, TimeoutError):
    """Nobody serves this service, and nobody began to within the call's timeout."""


class CallTimeout(ActorError, TimeoutError):
    """A server has the request but did not answer within the call's timeout. A late answer is dropped."""


class NotRunning(ActorError):
    """The node that served this has stopped for good."""


class NodeRestarting(ActorError):
    """The node that served this has failed and is being restarted; ask again. Its `incarnation` is the one that ended."""

    def __init__(self, node: str, incarnation: int) -> None:
        super().__init__(f"{node} (incarnation {incarnation}) has ended and is being restarted: try again in a moment")
        self.node = node
        self.incarnation = incarnation


class ProgramExit(ActorError):
    """Code of a node raised `SystemExit` or `KeyboardInterrupt`: the system stops in order, and then the program ends with it.

    `error` is what was raised. The block of `run` raises it when everything has stopped.
    """

    def __init__(self, where: str, error: SystemExit | KeyboardInterrupt) -> None:
        super().__init__(f"{where} asked the program to exit: {described(error)}")
        self.error = error
        self.__cause__ = error

    @property
    def code(self) -> int:
        """What the program exits with: as the interpreter would, 130 for `KeyboardInterrupt`."""
        if isinstance(self.error, KeyboardInterrupt):
            return 130
        code = self.error.code
        return code if isinstance(code, int) else int(code is not None)


class CallCycle(ActorError):
    """A call would wait for itself: each named node's handler waits for the next one's."""

    def __init__(self, nodes: tuple[str, ...]) -> None:
        super().__init__(
            f"this call can never be answered: {' waits for '.join((*nodes, nodes[0]))}; "
            "declare one of the handlers concurrent=n, or do not call back into a caller"
        )
        self.nodes = nodes


class ServiceFailed(ActorError):
    """The service handler raised: `node` served it, `type` and `text` are those of its exception."""

    def __init__(self, node: str, type: str, text: str) -> None:
        super().__init__(f"{node} failed to serve the request: {type}: {text}")
        self.node = node
        self.type = type
        self.text = text


class ActionUnavailable(ActorError, TimeoutError):
    """Nobody serves this action, and nobody began to within the timeout."""


class Reject(Exception):
    """Raise it in an ``@ACTION.accepts`` method to reject a goal with a reason. Out of the action itself it aborts the goal."""

    def __init__(self, reason: str = "") -> None:
        super().__init__(reason)
        self.reason = reason


class GoalRejected(ActorError):
    """The server did not accept the goal; `reason` is its own word."""

    def __init__(self, action: str, reason: str) -> None:
        super().__init__(f"{action} rejected the goal: {reason or 'no reason given'}")
        self.action = action
        self.reason = reason


class GoalFailed(ActorError):
    """A goal ended otherwise than by success: `reason` says why, `result` is what the body handed over, or None."""

    verb = "failed"

    def __init__(self, action: str, reason: str, result: object = None) -> None:
        super().__init__(f"{action}: goal {self.verb}: {reason or 'no reason given'}")
        self.action = action
        self.reason = reason
        self.result = result


class GoalCanceled(GoalFailed):
    """The goal was canceled, by its client or by a goal that preempted it."""

    verb = "canceled"


class GoalAborted(GoalFailed):
    """The goal's body raised, yielded `Aborted`, or ended without a result."""

    verb = "aborted"
