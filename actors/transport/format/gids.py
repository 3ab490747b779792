"""The identifier of an endpoint, which its messages carry: the XXH3 128-bit hash of its whole liveliness token.

Every peer computes it from the token, so a message's sender is found among the endpoints that are known.
"""

from __future__ import annotations

from typing import Final

__all__ = ["GID_SIZE", "gid_of"]

GID_SIZE: Final = 16
"""Bytes."""


def gid_of(token: str) -> bytes:
    """The 16 bytes for this token, which must be one that a writer or parser has accepted."""
    from xxhash import xxh3_128_digest  # only processes on a network need it

    return xxh3_128_digest(token.encode())[::-1]
