"""The charging station: what of it stands on the floor for a LiDAR to see, and its contacts, which are hardware and may look at the true pose."""

from __future__ import annotations

from math import atan2, cos, hypot, sin
from typing import TYPE_CHECKING

from robot.scenes.scene import Box, Pose2, Scene

if TYPE_CHECKING:  # the worlds are named by `--help`, which is not to wait for numpy
    from robot.hardware.body import Body, Truth

__all__ = ["FACE_AHEAD", "FACE_WIDTH", "charger_connected", "has_station", "heading", "station"]

FACE_AHEAD, FACE_WIDTH, DEPTH, HEIGHT = 0.85, 0.40, 0.15, 0.80
"""The station's face stands so far ahead of the body's middle when docked, and is so wide; the station's depth and height; metres."""
REACH = 0.3
"""How far the body may be off the dock, m: the contacts are long."""
TURN = 0.35
"""How far it may be turned, rad."""
DOWN = 0.25
"""The body must be lower than this over the floor, m: the contacts are under its belly."""


def station(dock: Pose2) -> Box:
    """What stands in front of a robot docked at `dock`."""
    ahead = FACE_AHEAD + DEPTH / 2
    x, y = dock.x + ahead * cos(dock.yaw), dock.y + ahead * sin(dock.yaw)
    return Box(x, y, DEPTH, FACE_WIDTH, yaw=dock.yaw, height=HEIGHT)


def has_station(scene: Scene) -> bool:
    """Whether the dock of this scene has something to see."""
    return station(scene.dock) in scene.obstacles


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
