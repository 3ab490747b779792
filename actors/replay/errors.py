"""`ReplayError`."""

from __future__ import annotations

from actors.errors import ActorError

__all__ = ["ReplayError"]


class ReplayError(ActorError):
    """A journal cannot be kept, read or replayed; the text says of which node, and why."""
