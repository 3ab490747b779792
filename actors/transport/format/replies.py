"""Errors as replies of a service, for clients of this library and for those of ROS 2, whose format has no place for them.

For a client of this library an error is the payload of a Zenoh error reply: four bytes, the last of which is the version, and a message in
CDR. Zenoh itself answers a query that took too long with an error reply whose payload is `TIMED_OUT`.
"""

from __future__ import annotations

from typing import Final, TypeAlias

from actors.errors import CallCycle, NodeRestarting, NotRunning, ServiceFailed
from actors.interfaces import CdrError, Message, MessageValueError, decode, encode
from actors.interfaces.types import Many, default, uint64
from actors.transport.format.errors import refuse

ReplyError: TypeAlias = CallCycle | NodeRestarting | NotRunning | ServiceFailed
"""Why a server could not answer. The caller receives it as if the server were in its own process."""

TIMED_OUT: Final = b"Timeout"

_MARK: Final = b"RBE\x01"

_FLAGS: Final = ("success", "successful", "accepted")
_REASONS: Final = ("message", "error_message", "status_message", "failure_reason", "reason")
"""The fields by which responses of ROS 2 say that a request failed, and why."""


class Failure(Message, frozen=True, kw_only=True):
    """All kinds of errors in one form. Fields that a kind does not use are empty."""

    kind: str
    nodes: Many[str] = default()
    incarnation: uint64 = 0
    type: str = ""
    text: str = ""


def write_reply_error(error: ReplyError) -> bytes:
    """Write an error as a payload. Characters that are not valid Unicode, as in file names, are escaped. Never raises."""
    return _MARK + encode(_failure(error))


def _failure(error: ReplyError) -> Failure:
    kind = type(error).__name__
    match error:
        case CallCycle():
            return Failure(kind=kind, nodes=map(_unicode, error.nodes))
        case NodeRestarting():
            return Failure(kind=kind, nodes=(_unicode(error.node),), incarnation=error.incarnation)
        case ServiceFailed():
            return Failure(
                kind=kind, nodes=(_unicode(error.node),), type=_unicode(error.type), text=_unicode(error.text)
            )
        case _:  # NotRunning
            return Failure(kind=kind, text=_unicode(str(error)))


def _unicode(text: str) -> str:
    return text.encode(errors="backslashreplace").decode()


def parse_reply_error(payload: bytes) -> ReplyError:
    """Parse the payload of an error reply. Raises WireFormatError, also for error replies of other peers."""
    if not payload.startswith(_MARK):
        raise refuse(payload, "an error of one of our peers", "it does not begin as such")
    try:
        failure = decode(Failure, payload[len(_MARK) :])
    except CdrError as error:
        raise refuse(payload, "an error of one of our peers", str(error)) from None
    match failure.kind, failure.nodes:
        case "CallCycle", (_, *_):
            return CallCycle(failure.nodes)
        case "NodeRestarting", (node,):
            return NodeRestarting(node, failure.incarnation)
        case "ServiceFailed", (node,):
            return ServiceFailed(node, failure.type, failure.text)
        case "NotRunning", ():
            return NotRunning(failure.text)
        case _:
            raise refuse(
                payload, "an error of one of our peers", f"there is no kind {failure.kind!r:.40} with these nodes"
            )


def encode_failure(response: type[Message], text: str) -> bytes | None:
    """A response in CDR that says that its request failed, with `text` where it has a field for a reason. None if it has no field that says so."""
    empty = response()
    if not (flags := {name: False for name in _FLAGS if isinstance(getattr(empty, name, None), bool)}):
        return None
    reasons = {name: text for name in _REASONS if isinstance(getattr(empty, name, None), str)}
    try:
        return encode(response(**flags, **reasons))
    except (CdrError, MessageValueError):  # the text is longer than its field may be
        return encode(response(**flags))
