"""The identifier of an endpoint, sent with each of its messages: the XXH3 128-bit hash of its complete liveliness token.

Every peer computes it from the token, and so finds the sender of a message among the known endpoints.
"""

from __future__ import annotations

from typing import Final

GID_SIZE: Final = 16
"""The size of an identifier, in bytes."""


def gid_of(token: str) -> bytes:
    """Return the 16 bytes for a token, which must have been written or accepted by `tokens`."""
    from xxhash import xxh3_128_digest  # only needed by processes on a network

    return xxh3_128_digest(token.encode())[::-1]
