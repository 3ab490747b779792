"""Requests and replies of services, as Cyclone DDS's middleware sends them: 16 bytes between the head of the CDR and the message.

=====  ====  =========================================================
start  size  content
=====  ====  =========================================================
0      4     head of the CDR, which tells the byte order of all that follows
4      8     client: a number that no other client of the service has
12     8     number of the request, signed
20     any   the message, aligned as if it began at 4
=====  ====  =========================================================

A reply repeats both numbers of its request, and reaches all clients of the service; each drops the replies to others. Fast DDS's middleware
sends the message alone, and the identity of the request in RTPS, where Cyclone DDS can neither read nor write it.
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

from actors.transport.format.errors import refuse

_HEAD: Final = 4
_BODY: Final = 20
_LITTLE: Final = struct.Struct("<Qq")
_ORDERS: Final = {b"\x00\x01": _LITTLE, b"\x00\x00": struct.Struct(">Qq")}


class RequestId(NamedTuple):
    """The identity of a request."""

    client: int
    """64 bits without a meaning for others; `rmw_cyclonedds_cpp` takes its writer's instance handle."""
    number: int
    """Counts the requests of a client, from 1."""


def write_request(request: RequestId, message: bytes) -> bytes:
    """Return a request or reply. `message` is little-endian CDR with its head. Raises WireFormatError."""
    if message[:2] != b"\x00\x01" or len(message) < _HEAD:
        raise refuse(message[:_HEAD], "a message", "it begins with 00 01 00 00, as little-endian CDR")
    try:
        return b"%b%b%b" % (message[:_HEAD], _LITTLE.pack(*request), message[_HEAD:])
    except struct.error:
        raise refuse(request, "the identity of a request", "its numbers have 64 bits") from None


def parse_request(data: bytes) -> tuple[RequestId, bytes]:
    """Split a request or reply into its identity and its message, which is CDR with its head. Raises WireFormatError."""
    order = _ORDERS.get(data[:2])
    if order is None or len(data) < _BODY:
        raise refuse(data[:_BODY], "a request or reply", f"it is plain CDR, at least {_BODY} bytes")
    return RequestId(*order.unpack_from(data, _HEAD)), data[:_HEAD] + data[_BODY:]
