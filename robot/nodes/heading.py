"""Tells the gait's odometry by how much its heading has drifted, from the scans of the last way."""

from __future__ import annotations

from math import inf
from typing import Final

from actors import Node, publishes
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Float64
from robot.contracts import HEADING_ERROR, ODOMETRY, SCAN
from robot.estimation.history import pose_history, started_over
from robot.estimation.scan_heading import ScanHeading
from robot.geometry.messages import from_pose, is_pose, seconds

PERIOD: Final = 0.15
"""A scan that comes sooner after the last one is left out, s: a heading drifts slowly, and a fit takes 3 ms."""


class Heading(Node):
    """Publishes odom/heading_error, 5 Hz: by how much odometry's heading is too large, as far as lidar/scan shows. It needs no map.

    Silent while scans show too little. After a restart of this node, or of the gait, the heading of that moment counts as right.
    """

    error = publishes(HEADING_ERROR)

    def __init__(self) -> None:
        self._tracker = ScanHeading()
        self._odoms = pose_history()
        self._last = (0.0, 0.0)
        self._taken = -inf

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        odom, stamp, newest = from_pose(message.pose.pose), seconds(message.header.stamp), self._odoms.newest
        if started_over(self._last, (odom.x, odom.y), stamp - newest if newest is not None else 0.0):
            self._odoms.clear()
            self._tracker.clear()
        self._last = (odom.x, odom.y)
        self._odoms.add(stamp, odom)

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        stamp = seconds(message.header.stamp)
        odom = self._odoms.at(stamp)
        if odom is None or 0.0 <= stamp - self._taken < PERIOD:
            return
        self._taken = stamp
        error = self._tracker.update(odom, message.ranges.astype(float))
        if error is not None:
            self.error(Float64(data=error))
