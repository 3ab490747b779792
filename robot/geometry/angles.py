"""Angles in the plane, rad."""

from __future__ import annotations

from math import atan2, pi, remainder, tau


def wrap(angle: float) -> float:
    """The same angle in (-pi, pi]; one that lies there comes back to the last bit. Raises `ValueError` for infinity."""
    wrapped = remainder(angle, tau)
    return pi if wrapped == -pi else wrapped


def yaw_of(w: float, x: float, y: float, z: float) -> float:
    """The yaw of an attitude that is given as a unit quaternion, in [-pi, pi]: rotations about z, y, x in this order."""
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
