"""Extensions of the attachment, by which processes of this library exchange what the format of ROS 2 has no place for.

Every request has an extension, which may be empty: it tells the server that the client can read the errors of `replies`. An extension
consists of four bytes, the last of which is the version, and a message in CDR. Other versions and the bytes of other peers are ignored.
"""

from __future__ import annotations

from typing import Final

from actors.interfaces import CdrError, Message, decode, encode
from actors.interfaces.types import Many, default, uint64
from actors.transport.format.errors import WireFormatError, refuse

_MARK: Final = b"RBA\x01"
_LONGEST: Final = 1 << 16
"""Bytes; a chain of a hundred nodes needs some ten thousand."""


class Waiting(Message, frozen=True, kw_only=True):
    """A node whose handler holds the inbox until a call that it has made is answered."""

    session: str
    """The Zenoh id of its process. Together with ``node_id`` it distinguishes nodes of the same name on two machines."""
    node_id: uint64
    name: str
    """Its fully qualified name, for errors."""


class Extension(Message, frozen=True, kw_only=True):
    """The content of an extension."""

    chain: Many[Waiting] = default()
    """In a request: the nodes that wait for its answer, longest wait first. A server on one of them would wait for itself."""
    reason: str = ""
    """In a reply about a goal: why the goal was rejected, aborted or canceled. In a question about a cycle: the name of the service or action
    that the last of `chain` is to answer."""


def _write(extension: Extension) -> bytes:
    return _MARK + encode(extension)


_NONE: Final = Extension()
NOTHING: Final = _write(_NONE)
"""The extension that says only that errors can be read, as nearly all requests have it."""


def write_extension(extension: Extension) -> bytes:
    """Write an extension as bytes. Raises WireFormatError for text that is not valid Unicode."""
    try:
        return _write(extension)
    except CdrError as error:
        raise WireFormatError(str(error)) from None


def parse_extension(data: bytes) -> Extension | None:
    """Parse the bytes after an attachment. Returns None for bytes of other peers; raises WireFormatError for an invalid extension."""
    if data == NOTHING:
        return _NONE
    if not data.startswith(_MARK):
        return None
    if len(data) > _LONGEST:
        raise refuse(len(data), "the length of an extension of an attachment", f"it is at most {_LONGEST}")
    try:
        return decode(Extension, data[len(_MARK) :])
    except CdrError as error:
        raise refuse(data, "an extension of an attachment", str(error)) from None
