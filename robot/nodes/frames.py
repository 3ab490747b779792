"""The robot's own frames: map, odom, base_link, the gimbal and the sensors.

map -> odom -> base_link -> imu_link
                         -> gimbal_link -> lidar_link, camera_link
"""

from __future__ import annotations

from collections import deque
from math import cos, sin

from actors import Node
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import Odometry
from actors.tf2 import StaticTransformBroadcaster, Transform, TransformBroadcaster, stamped
from robot.contracts import ODOMETRY, POSE
from robot.geometry.angles import yaw_of
from robot.geometry.messages import is_pose
from robot.hardware import mounts
from robot.model.robot import SPOT, RobotModel

REMEMBERED = 10
"""Odometry messages that wait for the map pose of their instant."""


class Frames(Node):
    """Publishes odom -> base_link -> gimbal_link with each odom and map -> odom with each pose, 50 Hz each; static mounts once.

    map -> odom is planar: a pose on the map has no roll and no pitch.
    """

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._model = model

    async def on_start(self) -> None:
        self._moving = TransformBroadcaster(self)
        self._fixed = StaticTransformBroadcaster(self)
        self._odoms: deque[tuple[Time, Transform]] = deque(maxlen=REMEMBERED)
        now = self.clock.stamp()
        self._fixed.send_transform(
            (
                stamped("base_link", "imu_link", mounts.IMU, now),
                stamped("gimbal_link", "lidar_link", mounts.LIDAR, now),
                stamped("gimbal_link", "camera_link", mounts.camera_of(self._model), now),
            )
        )

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        base, stamp = Transform.from_msg(message.pose.pose), message.header.stamp
        heading = _heading(base)
        self._odoms.append((stamp, Transform.planar(base.translation[0], base.translation[1], heading)))
        self._moving.send_transform(
            (stamped("odom", "base_link", base, stamp), stamped("base_link", "gimbal_link", leveled(base), stamp))
        )

    @POSE.on()
    def pose(self, message: PoseStamped) -> None:
        """The localizer stamps a pose with the odometry that it is made from."""
        if not is_pose(message.pose):
            return
        stamp = message.header.stamp
        for told, odom in reversed(self._odoms):
            if told == stamp:
                correction = Transform.from_msg(message.pose) @ odom.inverse()
                self._moving.send_transform(stamped("map", "odom", correction, stamp))
                return


def leveled(base: Transform) -> Transform:
    """The pose in base_link of a frame of the same origin and heading that has neither roll nor pitch."""
    half = _heading(base) / 2
    upright = Transform(rotation=(cos(half), 0.0, 0.0, sin(half)))
    return Transform(rotation=base.rotation).inverse() @ upright


def _heading(pose: Transform) -> float:
    w, x, y, z = pose.rotation
    return yaw_of(w, x, y, z)
