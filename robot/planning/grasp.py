"""Where to stand and how to bend the arm to take a thing: geometry only."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import NamedTuple

from robot.geometry.planar import Pose2, placed
from robot.model.arm import MOUNT, Angles, OutOfReach, Tip, inverse
from robot.model.parameters import FOOT_RADIUS, STAND_HEIGHT
from robot.planning.reach import reach_ring, standing_place

STANDING = STAND_HEIGHT + FOOT_RADIUS
"""Height of the body's origin when it stands, m."""
ABOVE = 0.12
"""How far over a thing the tool comes to it and leaves it, m."""
PITCHES = (0.6, 0.4, 0.8, 0.2, 1.0, 0.0, 1.2, 1.5)
"""How the tool looks down at a thing, rad, the first that can be reached."""
SHARE = 0.82
"""Where in the range of the arm the thing shall be: far out, so that the body keeps off what the thing stands on."""
TURNS = (0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.3, -2.3, pi)
"""Directions to come from, counted from the straight way, rad."""


class Spot(NamedTuple):
    """A point: on the map with z over the floor, or in base_link; m."""

    x: float
    y: float
    z: float


class Approach(NamedTuple):
    """Joint angles over a thing, and at it."""

    above: Angles
    at: Angles


def approach(spot: Spot) -> Approach:
    """How the arm gets to a point in base_link. Raises `OutOfReach`."""
    x, y, z = spot.x - MOUNT[0], spot.y - MOUNT[1], spot.z - MOUNT[2]
    problem: OutOfReach | None = None
    for pitch in PITCHES:
        try:
            return Approach(inverse(Tip(x, y, z + ABOVE, pitch)), inverse(Tip(x, y, z, pitch)))
        except OutOfReach as error:
            problem = problem or error
    assert problem is not None
    raise problem


def stands(spot: Spot, robot: Pose2) -> Iterator[Pose2]:
    """Poses to reach a point on the map from, facing it: on the straight way from `robot` first, then round the reach circle."""
    pitch = _pitch(spot.z)
    if pitch is None:
        return
    for turn in TURNS:
        x, y = placed(Pose2(spot.x, spot.y, turn), robot.x - spot.x, robot.y - spot.y)
        place = standing_place(spot, Pose2(x, y, robot.yaw + turn), STANDING, pitch, SHARE)
        if place is not None:
            yield place


def _pitch(height: float) -> float | None:
    """The tool's pitch with the widest reach at so many metres over the floor."""
    level = round(height - STANDING - MOUNT[2], 3)
    widths = [(ring[1] - ring[0], pitch) for pitch in PITCHES if (ring := reach_ring(level, pitch)) is not None]
    return max(widths, default=(0.0, None))[1]
