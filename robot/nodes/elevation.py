"""The elevation map: what depth cameras and LiDAR show of the floor around the robot, for planning and for viewers."""

from __future__ import annotations

import numpy as np

from actors import Node, every, publishes
from actors.images import cloud_of
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan, PointCloud2
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import DEPTH_POINTS, ELEVATION_POINTS, GAIT_STATUS, ODOMETRY, POSE, RELIEF, SCAN
from robot.estimation.elevation import ElevationMap
from robot.estimation.history import attitude_history, pose_history
from robot.geometry.angles import yaw_of
from robot.geometry.messages import from_pose, is_pose, seconds
from robot.geometry.vectors import Floats, Vector, rotation_of
from robot.hardware.beams import beam_angles, returns
from robot.hardware.depth import eyes
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.model.modes import ON_ITS_FEET
from robot.nodes.point_clouds import unpack_points

STANDING = 0.8
"""The floor under the robot, when it first stands, is taken to be level so far around it, m: its corners are 0.6 m away."""
CELL = np.dtype([(name, "<f4") for name in ("x", "y", "z", "doubt", "age")])
"""Of elevation/points."""


class Elevation(Node):
    """Publishes elevation, 10 Hz: where the floor can be trodden on; and elevation/points, 2 Hz, while somebody listens: what is known of each
    cell, with `doubt` (m, a standard deviation) and `age` (s, since it was seen last) as further fields.

    Takes depth/points, lidar/scan, odom (attitude and height), pose (where on the map) and gait_status: while the robot lies or rises, how
    high its cameras are is not known well enough, and nothing is taken in or said.
    """

    relief = publishes(RELIEF)
    points = publishes(ELEVATION_POINTS)

    async def on_start(self) -> None:
        self._poses, self._attitudes = pose_history(), attitude_history()
        self._map: ElevationMap | None = None
        self._up = False

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._up = message.mode in ON_ITS_FEET

    @POSE.on()
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        here, stamp = from_pose(message.pose), seconds(message.header.stamp)
        self._poses.add(stamp, here)
        if self._map is None and self._up:
            self._map = ElevationMap(here.x, here.y, STANDING, stamp)

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        q, z = message.pose.pose.orientation, message.pose.pose.position.z
        self._attitudes.add(seconds(message.header.stamp), (np.array([q.w, q.x, q.y, q.z]), z))

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        """The returns of a LiDAR that stays level, or of one in the plane of a body that leans."""
        stamp = seconds(message.header.stamp)
        here, lay = self._poses.at(stamp), self._attitudes.at(stamp)
        if self._map is None or not self._up or here is None or lay is None:
            return
        ranges = message.ranges.astype(float)
        met = np.where(returns(ranges), ranges, np.inf)
        x, y, z = _turned(lay[0], here.yaw)[:, 2].tolist()
        angles = beam_angles(len(ranges)) + here.yaw
        self._map.integrate_scan(stamp, here.x, here.y, lay[1], angles, met, (-x / z, -y / z))

    @DEPTH_POINTS.on()
    def depth(self, message: PointCloud2) -> None:
        stamp = seconds(message.header.stamp)
        here, lay = self._poses.at(stamp), self._attitudes.at(stamp)
        if self._map is None or not self._up or here is None or lay is None:
            return
        points = unpack_points(message).astype(np.float64)
        had = np.isfinite(points[:, 0])
        rotation, place = _turned(lay[0], here.yaw), np.array([here.x, here.y, lay[1]])
        self._map.move(here.x, here.y)
        self._map.integrate(stamp, points[had] @ rotation.T + place, eyes()[had] @ rotation.T + place, lay[1])
        self.relief(self._message(stamp, message.header))

    @every(hz=2)
    def show(self) -> None:
        if self._map is None or not self.points.subscription_count:
            return
        now, heights = self.clock.now(), self._map.heights
        known = np.isfinite(heights)
        cells = np.empty(int(known.sum()), dtype=CELL)
        layers = (*self._map.centres(), heights, self._map.doubt(now), self._map.age(now))
        for name, layer in zip(CELL.names or (), layers, strict=True):
            cells[name] = np.broadcast_to(layer, known.shape)[known]
        self.points(cloud_of(cells, Header(stamp=self.clock.stamp(), frame_id="map")))

    def _message(self, stamp: float, header: Header) -> OccupancyGrid:
        assert self._map is not None
        relief = self._map.relief(stamp)
        height, width = relief.cells.shape
        info = MapMetaData(
            map_load_time=header.stamp, resolution=relief.resolution, width=width, height=height,
            origin=Pose(position=Point(x=relief.origin_x, y=relief.origin_y)),
        )  # fmt: skip
        return OccupancyGrid(
            header=Header(stamp=header.stamp, frame_id="map"), info=info, data=relief.cells.reshape(-1)
        )


def _turned(attitude: Vector, yaw: float) -> Floats:
    """Body to map: the tilt of odometry, under the heading that the localizer has found."""
    w, x, y, z = attitude.tolist()
    turn = yaw - yaw_of(w, x, y, z)
    return rotation_of(np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)])) @ rotation_of(attitude)
