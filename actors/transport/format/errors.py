"""The error of this format."""

from __future__ import annotations


class WireFormatError(ValueError):
    """A text or bytes from the network are not in the format of a middleware of ROS 2, or a value cannot be written in it."""


def refuse(found: object, wanted: str, reason: str) -> WireFormatError:
    """Return the error to raise: ``found``, shortened if it is long, is not ``wanted``, because of ``reason``."""
    shown = repr(found)
    if len(shown) > 300:
        shown = f"{shown[:300]}..."
    return WireFormatError(f"{shown} is not {wanted}: {reason}")
