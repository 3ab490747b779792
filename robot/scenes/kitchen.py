"""A kitchen: two small tables, a red cup on one of them, a blue box behind the robot's back, and room to walk round it all.

The tables are lower than the LiDAR looks: the map knows them. They are far enough from each other and from the walls to be reached from any side.
"""

from __future__ import annotations

from math import pi
from types import MappingProxyType

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Scene, Thing

BOUNDS = (-3.0, -4.0, 7.0, 4.0)
WALLS = (
    Box(2.0, -4.05, 10.2, 0.1, height=2.0),
    Box(2.0, 4.05, 10.2, 0.1, height=2.0),
    Box(-3.05, 0.0, 0.1, 8.0, height=2.0),
    Box(7.05, 0.0, 0.1, 8.0, height=2.0),
)
TABLE, OTHER_TABLE, BOARD = Box(2.05, 1.0, 0.3, 0.3, height=0.45), Box(1.95, -1.0, 0.3, 0.3, height=0.4), 0.45


def kitchen(cup: tuple[float, float] = (2.0, 1.0)) -> Scene:
    """The scene, with the cup's middle at `cup` (m); at (2, 1) unless it is to be elsewhere on its table."""
    box_stand = Box(-2.0, 2.5, 0.3, 0.3, height=BOARD)
    things = (
        Thing("cup", Cylinder(*cup, 0.035, 0.10), (200, 20, 20), z=TABLE.height),
        Thing("box", Box(-2.0, 2.5, 0.06, 0.06, height=0.08), (20, 20, 220), z=BOARD),
    )
    start = Pose2(0.0, 0.0, 0.3)
    return Scene(
        name="kitchen",
        bounds=BOUNDS,
        obstacles=(*WALLS, TABLE, OTHER_TABLE, box_stand),
        start=start,
        dock=Pose2(-1.8, 0.0, pi),
        patrol=(Pose2(5.5, -2.8, pi / 2), Pose2(5.5, 2.8, pi), Pose2(0.0, 2.8, -pi / 2), Pose2(-1.8, -2.8, pi / 2)),
        places=MappingProxyType({"start": start, "table": Pose2(0.9, 1.0), "other_table": Pose2(0.8, -1.0)}),
        things=things,
    )
