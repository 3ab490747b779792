"""Turning a vector from the body's axes into those of the ground and back, in plain floats."""

from __future__ import annotations

from robot.model.legs import Rows, Triple

__all__ = ["to_body", "to_ground"]


def to_ground(rotation: Rows, vector: Triple) -> Triple:
    """R v: `rotation` is body to ground."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def to_body(rotation: Rows, vector: Triple) -> Triple:
    """R' v: `rotation` is body to ground."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)
