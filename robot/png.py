"""PNG files (RFC 2083): eight-bit RGB, written with nothing but zlib."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
"""Shape (height, width, 3), rows from the top."""

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_UP = 2


def encode(image: Image) -> bytes:
    """The file's bytes, the same for the same image. Every row is stored as its difference to the row above, which packs well."""
    height, width, channels = image.shape
    if channels != 3 or image.dtype != np.uint8:
        raise ValueError(f"a picture has three channels of bytes, not {channels} of {image.dtype}")
    above = np.vstack((np.zeros((1, width, 3), dtype=np.uint8), image[:-1]))
    rows = np.empty((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 0] = _UP
    rows[:, 1:] = (image - above).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + _chunk(b"IEND", b"")
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
