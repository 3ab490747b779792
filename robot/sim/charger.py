"""The contacts of the charging station, simulated: they look at where the body truly is."""

from __future__ import annotations

from math import hypot

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.sim.simulation import Truth

REACH = 0.3
"""How far the body may be off the dock, m: the contacts are long."""
TURN = 0.35
"""How far it may be turned, rad."""
DOWN = 0.25
"""The body must be lower than this over the floor, m: the contacts are under its belly."""


def charger_connected(truth: Truth, dock: Pose2) -> bool:
    """Whether the robot sits on its dock."""
    x, y, z = (float(v) for v in truth.position)
    return z < DOWN and hypot(x - dock.x, y - dock.y) < REACH and abs(wrap(truth.yaw - dock.yaw)) < TURN
