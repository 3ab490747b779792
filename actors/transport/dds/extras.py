"""What processes of this library add to requests and replies, behind the message: others never get it, because it is sent to our peers only.

====  ==========================================
size  content, from the end
====  ==========================================
7     ``robactr``
1     0: an extension; 1: an error in place of a reply
4     the length of the content, little endian
any   the content, padded to a multiple of 4
====  ==========================================
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

_END: Final = struct.Struct("<IB7s")
_MARK: Final = b"robactr"


class Extra(NamedTuple):
    """What is added."""

    content: bytes = b""
    is_error: bool = False


def add_extra(message: bytes, extra: Extra) -> bytes:
    """The message with what is added. Its length is a multiple of 4, so that the wire pads nothing."""
    padded = b"%b%b%b%b" % (message, bytes(-len(message) % 4), extra.content, bytes(-len(extra.content) % 4))
    return padded + _END.pack(len(extra.content), extra.is_error, _MARK)


def split_extra(data: bytes) -> tuple[bytes, Extra]:
    """The message, perhaps with padding, and what is added; nothing if there is none, or if it is none of ours."""
    if len(data) < _END.size:
        return data, Extra()
    length, is_error, mark = _END.unpack_from(data, len(data) - _END.size)
    start = len(data) - _END.size - length - (-length % 4)
    if mark != _MARK or start < 0:
        return data, Extra()
    return data[:start], Extra(data[start : start + length], bool(is_error))
