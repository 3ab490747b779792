"""Where the sensors sit on the body. LiDAR and camera hang in a gimbal at the body's origin that keeps them level: they turn with the
body's heading, not with its roll and pitch.
"""

from __future__ import annotations

from typing import Final

from actors.tf2 import Transform

IMU: Final = Transform()
"""imu_link in base_link."""
LIDAR: Final = Transform()
"""lidar_link in gimbal_link."""
CAMERA: Final = Transform((0.45, 0.0, 0.05))
"""camera_link in gimbal_link: x along the optical axis, y left, z up."""
