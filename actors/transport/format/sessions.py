"""The identities of processes on the network. Those of this library can be told from all others, which are ROS 2's."""

from __future__ import annotations

from random import Random
from typing import Final

_MARK: Final = "b0bac708"
"""How the sessions of this library begin; one of four billion others does, too."""


def new_session(rng: Random) -> str:
    """A session that no other process has: 32 digits of hex, the first of them not 0."""
    return f"{_MARK}{rng.getrandbits(96):024x}"


def is_ours(session: str) -> bool:
    """Whether the process is one of this library."""
    return len(session) == 32 and session.startswith(_MARK)
