"""What our own peers tell each other in the bytes behind an attachment, because the format of ROS 2 has no place for it.

Every request of ours carries an extension, also an empty one: by it the server knows that the client reads the errors of `replies`.
An extension is four bytes, the last of which is the version, and a message in CDR. Other versions, and other peers' bytes, are ignored.
"""

from __future__ import annotations

from typing import Final

from actors.interfaces import CdrError, Message, decode, encode
from actors.interfaces.types import Many, default, uint64
from actors.transport.format.errors import WireFormatError, refuse

__all__ = ["Extension", "Waiting", "parse_extension", "write_extension"]

_MARK: Final = b"RBA\x01"


class Waiting(Message, frozen=True, kw_only=True):
    """A node whose handler takes nothing else from its inbox until a call that it made is answered."""

    session: str
    """The Zenoh id of its process. With ``node_id`` it tells apart nodes of one name on two machines."""
    node_id: uint64
    name: str
    """Its fully qualified name, for the error."""


class Extension(Message, frozen=True, kw_only=True):
    """What stands behind an attachment."""

    chain: Many[Waiting] = default()
    """In a request: the nodes that wait for its answer, the one that waits longest first. A server that is among them would wait for itself."""
    reason: str = ""
    """In a reply about a goal: why it was rejected, aborted or canceled."""


def write_extension(extension: Extension) -> bytes:
    """The bytes. Raises WireFormatError for a text that is not Unicode."""
    try:
        return _MARK + encode(extension)
    except CdrError as error:
        raise WireFormatError(str(error)) from None


def parse_extension(data: bytes) -> Extension | None:
    """What these bytes behind an attachment say; None if they are none of ours. Raises WireFormatError if they are ours and broken."""
    if not data.startswith(_MARK):
        return None
    try:
        return decode(Extension, data[len(_MARK) :])
    except CdrError as error:
        raise refuse(data, "an extension of an attachment", str(error)) from None
