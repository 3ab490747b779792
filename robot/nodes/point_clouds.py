"""Clouds of points as sensor_msgs/PointCloud2: x, y and z as float32, packed and unpacked without a Python object for each point."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header
from robot.hardware.lens import column_slopes, row_slopes

FIELDS: Final = tuple(
    PointField(name=name, offset=4 * place, datatype=PointField.FLOAT32, count=1) for place, name in enumerate("xyz")
)
POINT_BYTES: Final = 12
STRIDE: Final = 8
"""Of a depth image, so many pixels of a row, and so many rows, give one point."""

_KINDS: Final = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}


def pack_points(header: Header, points: ArrayLike) -> PointCloud2:
    """A cloud of `points`, shape (n, 3), m in the header's frame; unordered (height 1). Raises `ValueError` for another shape."""
    given = np.asarray(points)
    if given.ndim != 2 or given.shape[1] != 3:
        raise ValueError(f"points must have the shape (n, 3), not {given.shape}")
    data = np.empty(len(given) * POINT_BYTES, dtype=np.uint8)
    data.view("<f4").reshape(-1, 3)[:] = given
    dense = bool(np.isfinite(given).all())
    data.setflags(write=False)
    return PointCloud2(
        header=header, height=1, width=len(given), fields=FIELDS, point_step=POINT_BYTES, row_step=len(data), data=data, is_dense=dense
    )  # fmt: skip


def unpack_points(cloud: PointCloud2) -> NDArray[np.float32]:
    """The points of a cloud, shape (n, 3), whatever else it holds and in whichever order its bytes are.

    Raises `ValueError` for a cloud without x, y and z as floating point numbers, or whose data is too short.
    """
    order = ">" if cloud.is_bigendian else "<"
    fields = {field.name: field for field in cloud.fields if field.datatype in _KINDS}
    if not {"x", "y", "z"} <= fields.keys():
        names = ", ".join(field.name for field in cloud.fields) or "none"
        raise ValueError(f"the cloud has no x, y and z as float32 or float64; its fields are: {names}")
    if cloud.width * cloud.height == 0:
        return np.empty((0, 3), dtype=np.float32)
    needed = cloud.row_step * (cloud.height - 1) + cloud.width * cloud.point_step
    if len(cloud.data) < needed:
        raise ValueError(
            f"a cloud of {cloud.height} x {cloud.width} points needs {needed} bytes and has {len(cloud.data)}"
        )
    result = np.empty((cloud.height, cloud.width, 3), dtype=np.float32)
    for place, name in enumerate("xyz"):
        field = fields[name]
        result[:, :, place] = np.ndarray(
            (cloud.height, cloud.width), order + _KINDS[field.datatype], cloud.data, field.offset, (cloud.row_step, cloud.point_step)
        )  # fmt: skip
    return result.reshape(-1, 3)


def points_of_scan(ranges: NDArray[np.floating], max_range: float) -> NDArray[np.float32]:
    """The returns of one revolution in the LiDAR's frame, shape (n, 3); beam i looks along -pi + i 2 pi / beams. The plane is z = 0."""
    angles = -np.pi + np.arange(len(ranges)) * (2.0 * np.pi / len(ranges))
    hit = ranges < max_range
    points = np.zeros((int(hit.sum()), 3), dtype=np.float32)
    points[:, 0], points[:, 1] = ranges[hit] * np.cos(angles[hit]), ranges[hit] * np.sin(angles[hit])
    return points


_GRID_Y, _GRID_Z = (
    grid.astype(np.float32)
    for grid in np.meshgrid(column_slopes()[STRIDE // 2 :: STRIDE], row_slopes()[STRIDE // 2 :: STRIDE])
)


def points_of_depth(millimetres: NDArray[np.uint16]) -> NDArray[np.float32]:
    """Points in the camera's frame (x forward), shape (n, 3), of every eighth pixel of every eighth row that has a depth."""
    ahead = millimetres[STRIDE // 2 :: STRIDE, STRIDE // 2 :: STRIDE].astype(np.float32) * np.float32(0.001)
    cloud = np.stack((ahead, _GRID_Y * ahead, _GRID_Z * ahead), axis=-1)
    return cloud[ahead > 0.0]
