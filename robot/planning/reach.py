"""Where the body must stand so that the arm reaches a thing."""

from __future__ import annotations

from functools import lru_cache
from math import atan2, cos, hypot, sin

from robot.geometry.planar import Pose2
from robot.model.arm import MOUNT, OutOfReach, Tip, inverse

GRASP_DISTANCE = 0.02
"""The tool's tip holds a thing that is nearer than this, m."""
_STEP = 0.005
_FARTHEST = 1.0
_UNDER = 1e-6
"""A thing nearer than this to the robot's middle lies in no direction, m."""

Ring = tuple[float, float]
"""Nearest and farthest horizontal distance from the arm's mount, m."""


@lru_cache(maxsize=64)
def reach_ring(height: float, pitch: float = 0.0) -> Ring | None:
    """Horizontal distances at which the tip gets to `height` m above the mount (negative: below) straight ahead.

    All joint limits count. The widest unbroken range, found to 5 mm; `None` if nothing is reachable at this height.
    """
    best: Ring | None = None
    begun: float | None = None
    for i in range(round(_FARTHEST / _STEP) + 1):
        distance = i * _STEP
        try:
            inverse(Tip(distance, 0.0, height, pitch))
        except OutOfReach:
            begun = None
            continue
        begun = distance if begun is None else begun
        if best is None or distance - begun > best[1] - best[0]:
            best = (begun, distance)
    return best


def standing_place(
    point: tuple[float, float, float], robot: Pose2, body_height: float, pitch: float = 0.0, share: float = 0.5
) -> Pose2 | None:
    """The pose on the way from `robot` to the thing at `point` from which the arm reaches it, facing it, at `share` of its range.

    `None` if no distance will do at this height. Obstacles are the planner's business.
    """
    ring = reach_ring(round(point[2] - body_height - MOUNT[2], 3), pitch)
    if ring is None:
        return None
    dx, dy = point[0] - robot.x, point[1] - robot.y
    yaw = atan2(dy, dx) if hypot(dx, dy) > _UNDER else robot.yaw
    back = ring[0] + share * (ring[1] - ring[0]) + MOUNT[0]
    return Pose2(point[0] - back * cos(yaw), point[1] - back * sin(yaw), yaw)
