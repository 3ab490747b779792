"""What the navigator keeps clear of, as the two costmaps that Nav2 publishes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, Quaternion
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid
from actors.interfaces.std_msgs.msg import Header
from robot.geometry.planar import Pose2, compose, inverse, placed
from robot.navigation.navigator import Navigator
from robot.planning.grid import UNKNOWN

SIDE = 4.0
"""Of the local costmap, m; chosen: turned any way it lies within the square in which distances are known."""


def global_costmap(navigator: Navigator, stamp: Time) -> OccupancyGrid:
    """The whole map, with the marks of what it does not show."""
    grid, unmapped = navigator.planner.grid, navigator.around.clearance_to_unmapped()
    clearance = grid.clearance if unmapped is None else np.minimum(grid.clearance, unmapped)
    cells = navigator.planner.occupancy(clearance)
    return _message("map", stamp, grid.resolution, (grid.origin_x, grid.origin_y), cells)


def local_costmap(navigator: Navigator, here: Pose2, odom: Pose2, stamp: Time) -> OccupancyGrid:
    """The square around a robot that is at `here` on the map, and at `odom` in the odometry's frame, whose cells are those of the message."""
    grid = navigator.planner.grid
    count = round(SIDE / grid.resolution)
    corner = [math.floor((middle - SIDE / 2) / grid.resolution) * grid.resolution for middle in (odom.x, odom.y)]
    steps = (np.arange(count) + 0.5) * grid.resolution
    x, y = np.meshgrid(corner[0] + steps, corner[1] + steps)
    shift = compose(here, inverse(odom))
    map_x, map_y = placed(shift, x.astype(np.float64), y.astype(np.float64))
    low_x, low_y, high_x, high_y = grid.bounds
    inside = (map_x >= low_x) & (map_x < high_x) & (map_y >= low_y) & (map_y < high_y)
    clearance = navigator.around.local_field(here).clearance(map_x, map_y)
    cells = np.where(inside, navigator.planner.occupancy(clearance), np.int8(UNKNOWN))
    return _message("odom", stamp, grid.resolution, (corner[0], corner[1]), cells)


def _message(
    frame: str, stamp: Time, resolution: float, corner: tuple[float, float], cells: NDArray[np.int8]
) -> OccupancyGrid:
    height, width = cells.shape
    origin = Pose(position=Point(x=corner[0], y=corner[1]), orientation=Quaternion(w=1.0))
    info = MapMetaData(map_load_time=stamp, resolution=resolution, width=width, height=height, origin=origin)
    return OccupancyGrid(header=Header(stamp=stamp, frame_id=frame), info=info, data=cells.reshape(-1))
