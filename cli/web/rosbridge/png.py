"""Texts as pictures, as rosbridge has them: the bytes of the text are the pixels of a PNG picture, which a browser unpacks."""

from __future__ import annotations

import base64
import math
import zlib
from struct import pack

PIXEL = 3
"""Bytes of a pixel."""


def png_text(text: str) -> str:
    """A picture of the text, in base64. Line breaks at the end fill the last row."""
    data = text.encode()
    pixels = max(1, math.ceil(len(data) / PIXEL))
    width = max(1, math.isqrt(pixels))
    height = math.ceil(pixels / width)
    data = data.ljust(width * height * PIXEL, b"\n")
    row = width * PIXEL
    rows = b"".join(b"\0" + data[begin : begin + row] for begin in range(0, len(data), row))
    head = pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows)) + _chunk(b"IEND", b"")
    return base64.b64encode(b"\x89PNG\r\n\x1a\n" + chunks).decode()


def _chunk(kind: bytes, data: bytes) -> bytes:
    return pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))
