"""Scans as the rest of the robot takes them: level, and of one instant, whatever the body did while the LiDAR turned."""

from __future__ import annotations

from collections import deque
from typing import Final

from actors import Node, publishes
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.tf2 import Transform
from actors.time import nanoseconds_of, stamp_of
from robot.contracts import ODOMETRY, SCAN, SCAN_RAW
from robot.estimation.deskew import Deskew
from robot.estimation.history import started_over
from robot.geometry.messages import is_pose, seconds
from robot.model.footprint import Footprint
from robot.model.robot import SPOT, RobotModel

NANOSECONDS: Final = 1_000_000_000
SLACK: Final = 0.005
"""The last beams may have looked so much after the newest odometry, s: a quarter of its period."""

WAITING: Final = 3
"""Sweeps that wait for odometry; of more, the newest stay."""


class ScanCorrection(Node):
    """Publishes lidar/scan: each lidar/scan_raw as a level LiDAR at the body's origin would have seen it when the last beam looked.

    A sweep waits for the odometry of its end, 20 ms at most. Without odometry there are no scans: the nodes that need them notice their silence.
    In the result a range of 0 is a beam of which nothing is known, such as one that met the floor or a leg.
    """

    scan = publishes(SCAN)

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._deskew = Deskew(Footprint.of(model))
        self._waiting: deque[LaserScan] = deque(maxlen=WAITING)
        self._last = (0.0, 0.0)

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        base = Transform.from_msg(message.pose.pose)
        x, y, _ = base.translation
        stamp, newest = seconds(message.header.stamp), self._deskew.newest
        if started_over(self._last, (x, y), stamp - newest if newest is not None else 0.0):
            self._deskew.clear()
        self._last = (x, y)
        self._deskew.add(stamp, base.translation, base.rpy)
        self._correct()

    @SCAN_RAW.on()
    def raw(self, message: LaserScan) -> None:
        self._waiting.append(message)
        self._correct()

    def _correct(self) -> None:
        """Publish the sweeps that odometry has reached the end of."""
        while self._waiting and (newest := self._deskew.newest) is not None:
            message = self._waiting[0]
            start, sweep = seconds(message.header.stamp), message.scan_time
            end = start + sweep
            if newest < end - SLACK:
                return
            self._waiting.popleft()
            at = min(end, newest)
            ranges = self._deskew.corrected(message.ranges.astype(float), start, sweep, at)
            if ranges is not None:
                stamp = stamp_of(nanoseconds_of(message.header.stamp) + round((at - start) * NANOSECONDS))
                header = message.header.replace(stamp=stamp, frame_id="lidar_link")
                self.scan(message.replace(header=header, ranges=ranges, time_increment=0.0))
