"""The LiDAR's drivers: one revolution of ranges at 10 Hz, and the same as points for subscribers."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from actors import Node, every, publishes
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import LIDAR_POINTS, SCAN, SCAN_RAW
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE
from robot.nodes.point_clouds import pack_points, points_of_scan

if TYPE_CHECKING:
    from robot.hardware.devices import LidarDevice


class Lidar(Node):
    """Publishes lidar/scan, 360 beams at 10 Hz, and lidar/points while somebody listens.

    Beam i looks along -pi + i 2 pi / 360 in lidar_link, which turns with the body's heading and stays level.
    """

    scan = publishes(SCAN)
    points = publishes(LIDAR_POINTS)

    def __init__(self, lidar: LidarDevice) -> None:
        self._lidar = lidar

    @every(hz=10)
    def turn(self) -> None:
        self._lidar.advance(self.clock.now())
        if not (self.scan.subscription_count or self.points.subscription_count):
            return
        sweep = self._lidar.scan()
        if sweep is None:
            return
        ranges = sweep.ranges
        header = Header(stamp=self.clock.stamp(), frame_id="lidar_link")
        self.scan(_scan(header, ranges, scan_time=0.1))
        if self.points.subscription_count:
            self.points(pack_points(header, points_of_scan(ranges, MAX_RANGE)))


class TurningLidar(Node):
    """Publishes lidar/scan_raw, the revolutions of a LiDAR that is fixed to the body, at its own pace of 10 Hz, and lidar/points while somebody
    listens.

    The stamp is that of the first beam; beam i looked along -pi + i 2 pi / 360 in base_link, i time_increment later. The points are as
    measured, too: what the walk did meanwhile is not taken out of them.
    """

    scan = publishes(SCAN_RAW)
    points = publishes(LIDAR_POINTS)

    def __init__(self, lidar: LidarDevice) -> None:
        self._lidar = lidar
        self._told = -inf

    async def on_start(self) -> None:
        self._lidar.advance(self.clock.now())
        self._lidar.scan()

    @every(hz=10)
    def turn(self) -> None:
        """Publish a revolution that has been finished since the last time."""
        self._lidar.advance(self.clock.now())
        if not (self.scan.subscription_count or self.points.subscription_count):
            return
        sweep = self._lidar.scan()
        if sweep is None or sweep.start <= self._told:
            return
        self._told = sweep.start
        header = Header(stamp=self.clock.stamp(sweep.start), frame_id="base_link")
        self.scan(_scan(header, sweep.ranges, scan_time=sweep.sweep, time_increment=sweep.sweep / len(sweep.ranges)))
        if self.points.subscription_count:
            self.points(pack_points(header, points_of_scan(sweep.ranges, MAX_RANGE)))


def _scan(header: Header, ranges: Floats, *, scan_time: float, time_increment: float = 0.0) -> LaserScan:
    step = 2.0 * np.pi / len(ranges)
    return LaserScan(
        header=header,
        angle_min=-np.pi,
        angle_max=np.pi - step,
        angle_increment=step,
        time_increment=time_increment,
        scan_time=scan_time,
        range_min=0.05,
        range_max=MAX_RANGE,
        ranges=ranges,
    )
