"""The attachment of every message, request and reply: 33 bytes, and an extension that only this library reads.

=====  ====  =========================================================
start  size  content
=====  ====  =========================================================
0      8     sequence number, signed, little endian
8      8     time of sending, nanoseconds since 1970, signed, little endian
16     1     16, the length of what follows
17     16    GID
33     any   extension (see `extensions`); ROS 2 sends and reads none
=====  ====  =========================================================

A reply repeats the sequence number and the GID of its request. A message without an attachment is dropped, as in ROS 2.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final, NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.gids import GID_SIZE

_LAYOUT: Final = struct.Struct("<qqB16s")
_unpack: Final = _LAYOUT.unpack_from
_number: Final = struct.Struct("<q").unpack_from
ATTACHMENT_SIZE: Final = _LAYOUT.size
"""The size of an attachment without extension, in bytes."""


class Attachment(NamedTuple):
    """The content of the attachment of one message."""

    sequence_number: int
    """The number of the message of its publisher, or of the request of its client, from 1. A gap means a loss."""
    source_time: int
    """The time of sending on the sender's clock, in nanoseconds since 1970."""
    gid: bytes
    """The identifier of the publisher or of the requesting client; see `gids`."""
    extension: bytes = b""
    """The bytes that follow, unchanged."""


def write_attachment(attachment: Attachment) -> bytes:
    """Write an attachment as bytes. Raises WireFormatError."""
    return attachment_of(*attachment)


def attachment_of(sequence_number: int, source_time: int, gid: bytes, extension: bytes = b"") -> bytes:
    """What `write_attachment` writes, from the parts. Raises WireFormatError."""
    _check(gid)
    try:
        return _LAYOUT.pack(sequence_number, source_time, GID_SIZE, gid) + extension
    except struct.error as error:
        refused = Attachment(sequence_number, source_time, gid, extension)
        raise refuse(refused, "an attachment", f"its numbers have 64 bits ({error})") from None


def attacher(gid: bytes) -> Callable[[int, int], bytes]:
    """What writes the attachments of one publisher or client, from the number and the time of each message. Raises WireFormatError."""
    _check(gid)
    pack = _LAYOUT.pack
    return lambda sequence_number, source_time: pack(sequence_number, source_time, GID_SIZE, gid)


def attaching(gid: bytes, put: Callable[[bytes, bytes], None]) -> Callable[[bytes, int, int], None]:
    """What calls `put` with each payload of one publisher and its attachment, from the number and the time of the message. Raises WireFormatError."""
    _check(gid)
    pack = _LAYOUT.pack

    def put_attached(payload: bytes, sequence_number: int, source_time: int) -> None:
        put(payload, pack(sequence_number, source_time, GID_SIZE, gid))

    return put_attached


def _check(gid: bytes) -> None:
    if len(gid) != GID_SIZE:
        raise refuse(gid, "a GID", f"it has {GID_SIZE} bytes")


def attached(data: bytes) -> tuple[int, int, bytes]:
    """The sequence number, the source time and the GID in the attachment of a message. Raises WireFormatError."""
    try:
        number, time, size, gid = _unpack(data)
        if size == GID_SIZE:
            return number, time, gid
    except struct.error:
        pass
    raise refuse(data, "an attachment", f"it has at least {ATTACHMENT_SIZE} bytes, of which number 16 is {GID_SIZE}")


def in_order(attachments: list[bytes]) -> tuple[int, bytes] | None:
    """The first number, and the GID, in the attachments of messages that follow each other; None if their numbers do not.

    All but the numbers and the times is as in the first of them. Raises WireFormatError for that one."""
    first, _, gid = attached(attachments[0])
    numbers = [_number(each)[0] for each in attachments]
    return (first, gid) if numbers == list(range(first, first + len(numbers))) else None


def parse_attachment(data: bytes) -> Attachment:
    """Parse an attachment. Raises WireFormatError."""
    return Attachment(*attached(data), data[ATTACHMENT_SIZE:])
