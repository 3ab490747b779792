"""`ReplayError` and `NoJournal`."""

from __future__ import annotations

from actors.errors import ActorError


class ReplayError(ActorError):
    """A journal cannot be kept, read or replayed; the text says of which node, and why."""


class NoJournal(ReplayError):
    """A bag has no journal of the node or subtree that is asked for; the text says which it has."""
