"""What a client can do wrong."""

from __future__ import annotations

from typing import Any


class Refused(Exception):
    """What a client asks for cannot be done; the text tells it why."""

    id: Any = None
    """The id of the request, where it was not the one that is being handled."""


class BadRequest(Refused):
    """A frame of a client is none of its protocol."""
