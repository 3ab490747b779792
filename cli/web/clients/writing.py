"""Frames as a WebSocket server writes them (RFC 6455: whole, not masked), many in one piece.

A write of its own for each frame is a call of the operating system for each message and client; that is most of what a message costs.
"""

from __future__ import annotations

from collections.abc import Iterable
from struct import Struct

from cli.web.clients.outbox import Frame, Spliced

TEXT, BINARY = 0x81, 0x82
"""The first byte of a frame that is the whole message."""
WITHIN_HEAD, WITHIN_16_BITS = 125, 0xFFFF
"""The largest payloads whose size stands in the second byte, and in two bytes behind it."""
_SMALL, _MEDIUM, _LARGE = Struct("!BB"), Struct("!BBH"), Struct("!BBQ")
_IN_16_BITS, _IN_64_BITS = 126, 127


def written(frames: Iterable[Frame | Spliced]) -> bytes:
    """What goes over the connection for these frames, in order."""
    pieces: list[bytes] = []
    for frame in frames:
        if isinstance(frame, Spliced):
            pieces += (_head(BINARY, len(frame)), frame.head, frame.payload)
        elif isinstance(frame, bytes):
            pieces += (_head(BINARY, len(frame)), frame)
        else:
            data = frame.encode()
            pieces += (_head(TEXT, len(data)), data)
    return b"".join(pieces)


def _head(first: int, size: int) -> bytes:
    if size <= WITHIN_HEAD:
        return _SMALL.pack(first, size)
    if size <= WITHIN_16_BITS:
        return _MEDIUM.pack(first, _IN_16_BITS, size)
    return _LARGE.pack(first, _IN_64_BITS, size)
