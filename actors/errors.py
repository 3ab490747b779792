"""The errors that `actors` raises to its users. Their texts say what happened, where, and what to do next.

Those that programs catch most often are names of `actors`: `ActorError`, the base of all, and what calls, goals and trees raise.
"""

from __future__ import annotations

import linecache
import re
from typing import Any, Final

from actors.suggest import did_you_mean

__all__ = [
    "CallCycle",
    "Ended",
    "InvalidFilter",
    "NodeRestarting",
    "NotRunning",
    "NotStarted",
    "ProcessDied",
    "ProcessHung",
    "ProgramExit",
    "RemoteError",
    "TickMissed",
    "WrongThread",
    "WrongType",
]

_UNEXPECTED: Final = re.compile(r"Unexpected keyword argument '(\w+)'")
_POSITIONAL: Final = "Extra positional arguments provided"


def described(value: object) -> str:
    """The type and the text of a value or an error, for use in a sentence. The text of a value is at most 60 characters long."""
    return (
        f"{type(value).__name__}: {value}{_meant(value)}"
        if isinstance(value, BaseException)
        else f"{type(value).__name__} {value!r:.60}"
    )


def explain(error: BaseException | None) -> None:
    """Add to an error that leaves a block, as a note, what `described` says beside its text. Python's own hints are left to Python."""
    if isinstance(error, TypeError) and (meant := _meant(error)) and not hasattr(error, "__notes__"):
        error.add_note(f"{error}{meant}")


def _meant(error: BaseException) -> str:
    """``; did you mean 'speed'?`` for an `AttributeError` on an object that has an attribute of nearly that name; what a message takes, for a
    `TypeError` of its call; the missing `await`, for a coroutine that is used as what it returns; else empty."""
    if isinstance(error, (AttributeError, TypeError)) and "'coroutine' object" in str(error):
        return "; write `await` before the call that made it"
    if type(error) is TypeError:
        return _meant_field(error)
    if type(error) is not AttributeError or not error.name:
        return ""
    try:
        known = [name for name in dir(error.obj) if name.startswith("_") <= error.name.startswith("_")]
    except Exception:  # an object whose `__dir__` fails
        return ""
    return did_you_mean(error.name, known)


def _meant_field(error: TypeError) -> str:
    """Which message could not be made, and of which fields it can be: the text of msgspec names neither.

    Read from the line that made it, because a check in the class would make every message slower.
    """
    unknown = _UNEXPECTED.fullmatch(str(error))
    trace = error.__traceback__
    if trace is None or not (unknown or str(error) == _POSITIONAL):
        return ""
    from inspect import getattr_static  # late: it is needed only when something is already wrong

    while trace.tb_next is not None:
        trace = trace.tb_next
    frame = trace.tb_frame
    places = list(frame.f_code.co_positions())
    first, last, start, end = places[trace.tb_lasti // 2]
    lines = [line.encode() for line in linecache.getlines(frame.f_code.co_filename)[(first or 1) - 1 : last or 0]]
    if not lines:
        return ""
    lines[-1] = lines[-1][:end]
    written = b"".join(lines)[start:].decode(errors="replace")
    owner, *parts = written.partition("(")[0].strip().split(".")
    made: object = frame.f_locals.get(owner, frame.f_globals.get(owner))
    for part in parts:
        made = getattr_static(made, part, None)  # which runs no code of the user
    fields: tuple[str, ...] = getattr(made, "__struct_fields__", ())
    if not isinstance(made, type) or not fields:
        return ""
    if unknown:
        hint = did_you_mean(unknown[1], fields) or f"; it has {', '.join(fields)}"
        return f" of {made.__name__}{hint}"
    return f" to {made.__name__}: name its fields, as in {made.__name__}({fields[0]}=...)"


def _inset(text: str) -> str:
    """The text of another, whose further lines do not look like lines of ours."""
    return text.replace("\n", "\n    ")


def reduce_error(self: object) -> tuple[Any, ...]:
    """`__reduce__` for an error whose constructor takes something else than the text: pickles and copies keep text and attributes."""
    assert isinstance(self, BaseException)
    return _made, (type(self), self.args), vars(self)


def _made(kind: type[BaseException], args: tuple[object, ...]) -> BaseException:
    return kind.__new__(kind, *args)


class ActorError(Exception):
    """Base of all errors that `actors` raises about the running system."""

    __reduce__ = reduce_error


class DeclarationError(TypeError):
    """A node class, a contract or a tree is declared wrongly. Raised when the class or object is made, not when it is used."""


class NotStarted(ActorError):
    """A node, a system or a part of one was used before it was started."""


class Ended(ActorError):
    """A node, or a part of one, was used after its end, which is final: a restarted node is another incarnation."""


class WrongType(ActorError, TypeError):
    """A message, request, goal or reply is not of its contract's type."""


class WrongThread(ActorError):
    """A node was used from a thread other than its event loop's. Use `node.threadsafe`."""


class ServiceUnavailable(ActorError, TimeoutError):
    """No node served this service before the timeout of the call passed."""


class CallTimeout(ActorError, TimeoutError):
    """A server received the request but did not answer before the timeout of the call passed. A late answer is dropped."""


class NotRunning(ActorError):
    """A node or system that is needed for this has stopped for good."""


class NodeRestarting(ActorError):
    """The node that served this has failed and is being restarted; ask again. `incarnation` is the number of the life that ended."""

    def __init__(self, node: str, incarnation: int) -> None:
        super().__init__(f"{node} (incarnation {incarnation}) has ended and is being restarted: try again in a moment")
        self.node = node
        self.incarnation = incarnation


class ProgramExit(ActorError):
    """Code of a node raised `SystemExit` or `KeyboardInterrupt`, which stops the whole system in order.

    `error` is that exception. The block of `run` raises it once everything has stopped.
    """

    def __init__(self, where: str, error: SystemExit | KeyboardInterrupt) -> None:
        super().__init__(f"{where} asked the program to exit: {described(error)}")
        self.error = error
        self.__cause__ = error

    @property
    def code(self) -> int:
        """The exit code of the program: that of the `SystemExit`, or 130 for `KeyboardInterrupt`."""
        if isinstance(self.error, KeyboardInterrupt):
            return 130
        code = self.error.code
        return code if isinstance(code, int) else int(code is not None)


class CallCycle(ActorError):
    """A call could never be answered: the handler of each node in `nodes` waits for that of the next, and the last for the first."""

    def __init__(self, nodes: tuple[str, ...]) -> None:
        super().__init__(
            f"this call can never be answered: {' waits for '.join((*nodes, nodes[0]))}; "
            "declare one of the handlers concurrent=n, or do not call back into a caller"
        )
        self.nodes = nodes


class ServiceFailed(ActorError):
    """The service handler raised an exception: `type` and `text` are those of the exception, `node` is the node that served."""

    def __init__(self, node: str, type: str, text: str) -> None:
        super().__init__(f"{node} failed to serve the request: {type}: {_inset(text)}")
        self.node = node
        self.type = type
        self.text = text


class ActionUnavailable(ActorError, TimeoutError):
    """No node served this action, or none accepted the goal, before the timeout passed."""


class Reject(Exception):
    """Raise it in an ``@ACTION.accepts`` method to reject a goal with a reason. Raised in the action's body it aborts the goal."""

    def __init__(self, reason: str = "") -> None:
        super().__init__(reason)
        self.reason = reason


class GoalRejected(ActorError):
    """The server rejected the goal; `reason` is the text that the server gave, or empty."""

    def __init__(self, action: str, reason: str) -> None:
        super().__init__(f"{action} rejected the goal: {_inset(reason) or 'no reason given'}")
        self.action = action
        self.reason = reason


class GoalFailed(ActorError):
    """A goal ended without success: `reason` says why, `result` is the result that its body gave, or None."""

    verb = "failed"

    def __init__(self, action: str, reason: str, result: object = None) -> None:
        super().__init__(f"{action}: goal {self.verb}: {_inset(reason) or 'no reason given'}")
        self.action = action
        self.reason = reason
        self.result = result


class GoalCanceled(GoalFailed):
    """The goal was canceled, by its client or by a goal that preempted it."""

    verb = "canceled"


class GoalAborted(GoalFailed):
    """The goal's body raised, yielded `Aborted`, or ended without a result."""

    verb = "aborted"


class ProcessDied(ActorError):
    """A process ended without being asked to, and without a reason of its own: it exited, or a signal ended it.

    `process` is its id, `how` describes its end.
    """

    def __init__(self, process: int, how: str) -> None:
        super().__init__(f"process {process} has ended: {how}")
        self.process = process
        self.how = how


class ProcessHung(ActorError):
    """The event loop of a process did not turn for `seconds`, and the process was killed. `where` says what it was doing, if that is known."""

    def __init__(self, process: int, seconds: float, where: str) -> None:
        super().__init__(
            f"the event loop of process {process} did not turn for {seconds:g} s{f': {where}' if where else ''}"
        )
        self.process = process
        self.seconds = seconds
        self.where = where


class RemoteError(ActorError):
    """Stands for an error of another process whose class cannot be found in this one. `kind` is the name of that class."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(f"{kind}: {text}" if text else kind)
        self.kind = kind


class TickMissed(ActorError):
    """A tick of a timer with ``late="fault"`` was due before the tick before it had begun."""


class InvalidFilter(ValueError):
    """A `ContentFilter` that cannot be read, or that names a field or parameter that does not exist."""
