"""What travels beside the payload of every message, request and reply: 33 bytes, and behind them what only our own peers read.

=====  ====  =========================================================
start  size  content
=====  ====  =========================================================
0      8     sequence number, signed, little endian
8      8     time of sending, nanoseconds since 1970, signed, little endian
16     1     16, the length of what follows
17     16    GID
33     any   extension (see `extensions`); ROS 2 sends and reads none
=====  ====  =========================================================

A reply repeats sequence number and GID of its request. What arrives without an attachment is dropped, as ROS 2 does.
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.gids import GID_SIZE

__all__ = ["ATTACHMENT_SIZE", "Attachment", "parse_attachment", "write_attachment"]

_LAYOUT: Final = struct.Struct("<qqB16s")
ATTACHMENT_SIZE: Final = _LAYOUT.size
"""Bytes of an attachment without extension."""


class Attachment(NamedTuple):
    """What the attachment of one message says."""

    sequence_number: int
    """Counts the messages of a publisher, or the requests of a client, from 1. A gap is a loss."""
    source_time: int
    """When it was sent, in nanoseconds since 1970 by the sender's clock."""
    gid: bytes
    """The publisher, or the client that asks; see `gids`."""
    extension: bytes = b""
    """What follows, as it is."""


def write_attachment(attachment: Attachment) -> bytes:
    """The bytes. Raises WireFormatError."""
    number, time, gid, extension = attachment
    if len(gid) != GID_SIZE:
        raise refuse(gid, "a GID", f"it has {GID_SIZE} bytes")
    try:
        return _LAYOUT.pack(number, time, GID_SIZE, gid) + extension
    except struct.error as error:
        raise refuse(attachment, "an attachment", f"its numbers have 64 bits ({error})") from None


def parse_attachment(data: bytes) -> Attachment:
    """What these bytes say. Raises WireFormatError."""
    if len(data) < ATTACHMENT_SIZE or data[16] != GID_SIZE:
        raise refuse(
            data, "an attachment", f"it has at least {ATTACHMENT_SIZE} bytes, of which number 16 is {GID_SIZE}"
        )
    number, time, _, gid = _LAYOUT.unpack_from(data)
    return Attachment(number, time, gid, data[ATTACHMENT_SIZE:])
