"""Where the sensors sit on the body. LiDAR and camera hang in a gimbal at the body's origin that keeps them level: they turn with the
body's heading, not with its roll and pitch.
"""

from __future__ import annotations

from typing import Final

from actors.tf2 import Transform
from robot.model.robot import SPOT, RobotModel

IMU: Final = Transform()
"""imu_link in base_link."""
LIDAR: Final = Transform()
"""lidar_link in gimbal_link."""
CAMERA: Final = Transform((0.45, 0.0, 0.05))
"""camera_link of the reference body in gimbal_link: x along the optical axis, y left, z up."""


def camera_of(model: RobotModel) -> Transform:
    """The same of another robot, in proportion to its trunk and its legs: the camera looks out at the front."""
    ahead, left, up = CAMERA.translation
    return Transform((ahead * _front(model) / _front(SPOT), left, up * model.length))


def _front(model: RobotModel) -> float:
    return max(model.trunk[0] / 2.0, model.hips[0][0])
