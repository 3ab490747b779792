"""The dock's charging contacts: closed when the robot sits on its dock. Hardware, so it may look at the true pose."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

from robot.world.body import Body, Truth

__all__ = ["charger_connected", "heading"]

REACH = 0.3
"""How far the body may be off the dock, m: the contacts are long."""
TURN = 0.35
"""How far it may be turned, rad."""
DOWN = 0.25
"""The body must be lower than this over the floor, m: the contacts are under its belly."""


def heading(truth: Truth) -> float:
    """The true yaw, rad."""
    w, x, y, z = (float(v) for v in truth.quaternion)
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def charger_connected(body: Body) -> bool:
    """Whether the robot sits on its dock."""
    truth, dock = body.truth(), body.scene.dock
    x, y, z = (float(v) for v in truth.position)
    off = heading(truth) - dock.yaw
    return z < DOWN and hypot(x - dock.x, y - dock.y) < REACH and abs(atan2(sin(off), cos(off))) < TURN
