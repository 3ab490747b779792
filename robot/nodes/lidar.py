"""The LiDAR's driver: one revolution of ranges at 10 Hz, and the same as points for those who ask."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actors import Node, every, publishes
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import LIDAR_POINTS, SCAN
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.nodes.point_clouds import pack_points, points_of_scan

if TYPE_CHECKING:
    from robot.hardware.body import Body

__all__ = ["Lidar"]


class Lidar(Node):
    """Publishes lidar/scan, 360 beams at 10 Hz, and lidar/points while somebody listens.

    Beam i looks along -pi + i 2 pi / 360 in lidar_link, which turns with the body's heading and stays level.
    """

    scan = publishes(SCAN)
    points = publishes(LIDAR_POINTS)

    def __init__(self, body: Body) -> None:
        self._body = body

    @every(hz=10)
    def turn(self) -> None:
        self._body.advance(self.clock.now())
        step = 2.0 * np.pi / BEAMS
        ranges = self._body.lidar(BEAMS, MAX_RANGE)
        header = Header(stamp=self.clock.stamp(), frame_id="lidar_link")
        self.scan(
            LaserScan(
                header=header,
                angle_min=-np.pi,
                angle_max=np.pi - step,
                angle_increment=step,
                scan_time=0.1,
                range_min=0.05,
                range_max=MAX_RANGE,
                ranges=ranges,
            )
        )
        if self.points.subscription_count:
            self.points(pack_points(header, points_of_scan(ranges, MAX_RANGE)))
