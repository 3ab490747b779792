"""The points of a cloud, given in another frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.tf2.errors import InvalidArgumentException

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from actors.tf2.transform import Transform

FLOATS = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}


def transformed(cloud: PointCloud2, transform: Transform) -> NDArray[np.uint8]:
    """The data of the cloud with its x, y and z taken across; the other bytes stay. Works on rows with padding, and either byte order.

    Raises `InvalidArgumentException` if x, y and z are not there, each one float.
    """
    places = {field.name: field for field in cloud.fields if field.datatype in FLOATS and field.count in (0, 1)}
    if not {"x", "y", "z"} <= places.keys():
        there = ", ".join(field.name for field in cloud.fields) or "none"
        raise InvalidArgumentException(
            f"a cloud needs fields x, y and z, each one FLOAT32 or FLOAT64, to be transformed; its fields: {there}"
        )
    row = cloud.row_step or cloud.width * cloud.point_step
    order = ">" if cloud.is_bigendian else "<"
    kinds = {name: np.dtype(order + FLOATS[places[name].datatype]) for name in "xyz"}
    too_wide = any(places[name].offset + kind.itemsize > cloud.point_step for name, kind in kinds.items())
    if too_wide or cloud.width * cloud.point_step > row or cloud.height * row > len(cloud.data):
        raise InvalidArgumentException(
            f"a cloud of {cloud.height} x {cloud.width} points of {cloud.point_step} bytes, {row} bytes a row, "
            f"does not fit into its {len(cloud.data)} bytes of data"
        )
    data = np.array(cloud.data, dtype=np.uint8)  # a copy
    if not cloud.width * cloud.height:
        return data
    axes = [
        np.ndarray(
            shape=(cloud.height, cloud.width),
            dtype=kinds[name],
            buffer=data,
            offset=places[name].offset,
            strides=(row, cloud.point_step),
        )
        for name in "xyz"
    ]
    points = transform.points(np.stack(axes, axis=-1).reshape(-1, 3)).reshape(cloud.height, cloud.width, 3)
    for axis, values in zip(axes, np.moveaxis(points, -1, 0), strict=True):
        axis[:] = values
    return data
