"""Text on the wire that is not UTF-8: `wstring`, which every middleware writes in its own way."""

from __future__ import annotations

import struct
from typing import Literal, TypeAlias

WStrings: TypeAlias = Literal["zenoh", "cyclone"]
"""`zenoh` (and Fast CDR): number of UTF-16 units, then 4 bytes each. `cyclone`: number of bytes, then 2 bytes a unit."""


def encode_wide(text: str, form: WStrings) -> tuple[int, bytes]:
    """The count that stands before a wide string, and its bytes. There is no NUL at the end."""
    data = text.encode("utf-16-le")
    if form == "cyclone":
        return len(data), data
    count = len(data) // 2
    return count, struct.pack(f"<{count}I", *struct.unpack(f"<{count}H", data))


def wide_size(count: int, form: WStrings) -> int:
    """The number of bytes that a wide string with this count takes."""
    return count if form == "cyclone" else 4 * count


def decode_wide(data: bytes, form: WStrings, order: str) -> str:
    """The text of these bytes in byte order `<` or `>`. What is not UTF-16 becomes U+FFFD, as in other strings."""
    if form != "cyclone":
        count = len(data) // 4
        units = struct.unpack(f"{order}{count}I", data)
        data = struct.pack(f"{order}{count}H", *(unit if unit <= 0xFFFF else 0xFFFD for unit in units))
    return data.decode("utf-16-le" if order == "<" else "utf-16-be", "replace")
