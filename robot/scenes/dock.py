"""The charging station: what of it stands on the floor for a LiDAR to see."""

from __future__ import annotations

from math import cos, sin

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Scene

FACE_AHEAD, FACE_WIDTH, DEPTH, HEIGHT = 0.85, 0.40, 0.15, 0.80
"""The station's face stands so far ahead of the body's middle when docked, and is so wide; the station's depth and height; metres."""


BEFORE = Pose2(-0.8, 0.0, 0.0)
"""In front of the dock, in its frame: where the final approach begins, and where a robot is as good as home, m."""


def station(dock: Pose2) -> Box:
    """What stands in front of a robot docked at `dock`."""
    ahead = FACE_AHEAD + DEPTH / 2
    x, y = dock.x + ahead * cos(dock.yaw), dock.y + ahead * sin(dock.yaw)
    return Box(x, y, DEPTH, FACE_WIDTH, yaw=dock.yaw, height=HEIGHT)


def has_station(scene: Scene) -> bool:
    """Whether the dock of this scene has something to see."""
    return station(scene.dock) in scene.obstacles
