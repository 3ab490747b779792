"""What a client can do wrong."""

from __future__ import annotations

__all__ = ["BadRequest", "Refused"]


class Refused(Exception):
    """What a client asks for cannot be done; the text tells it why."""


class BadRequest(Refused):
    """A frame of a client is none of its protocol."""
