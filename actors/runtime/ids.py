"""Ids in the form of UUIDs, drawn from a generator of random numbers."""

from __future__ import annotations

from random import Random

__all__ = ["uuid_of"]


def uuid_of(numbers: Random) -> bytes:
    """The next id of `numbers`: 16 bytes in the form of a random UUID (version 4)."""
    raw = bytearray(numbers.randbytes(16))
    raw[6] = raw[6] & 0x0F | 0x40
    raw[8] = raw[8] & 0x3F | 0x80
    return bytes(raw)
