"""The camera's pinhole: which pixel looks where. Camera axes are x forward, y left, z up; columns go right, rows down.

A point (x, y, z) in front of the camera lies in column CX - F y / x and row CY - F z / x; its depth is x.
"""

from __future__ import annotations

from math import radians, tan
from typing import Final

import numpy as np

from actors.interfaces.sensor_msgs.msg import CameraInfo
from actors.interfaces.std_msgs.msg import Header
from robot.geometry.vectors import Floats

WIDTH: Final = 640
HEIGHT: Final = 480
FIELD: Final = radians(70.0)
"""Angle between the left and the right edge of the picture."""
FOCAL: Final = WIDTH / 2 / tan(FIELD / 2)
"""Focal length, pixels; pixels are square."""
CX: Final = WIDTH / 2 - 0.5
CY: Final = HEIGHT / 2 - 0.5
"""The pixel on the optical axis: the middle of pixel i is at i."""


def column_slopes() -> Floats:
    """y / x of what each column sees, shape (WIDTH,)."""
    return (CX - np.arange(WIDTH, dtype=np.float64)) / FOCAL


def row_slopes() -> Floats:
    """z / x of what each row sees, shape (HEIGHT,)."""
    return (CY - np.arange(HEIGHT, dtype=np.float64)) / FOCAL


def project(x: float, y: float, z: float) -> tuple[float, float]:
    """Column and row of a point in camera axes, m. Raises `ValueError` for a point that is not in front of the camera."""
    if x <= 0.0:
        raise ValueError(f"a point {x:g} m ahead is not in front of the camera: it has no place in the picture")
    return CX - FOCAL * y / x, CY - FOCAL * z / x


def deproject(column: float, row: float, depth: float) -> tuple[float, float, float]:
    """The point in camera axes, m, that lies `depth` m ahead in this pixel."""
    return depth, (CX - column) / FOCAL * depth, (CY - row) / FOCAL * depth


def camera_info(header: Header) -> CameraInfo:
    """The lens as ROS says it. Its matrices are for optical axes (z forward, x right, y down)."""
    return CameraInfo(
        header=header,
        height=HEIGHT,
        width=WIDTH,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([FOCAL, 0.0, CX, 0.0, FOCAL, CY, 0.0, 0.0, 1.0]),
        r=np.eye(3).ravel(),
        p=np.array([FOCAL, 0.0, CX, 0.0, 0.0, FOCAL, CY, 0.0, 0.0, 0.0, 1.0, 0.0]),
    )
