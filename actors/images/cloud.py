"""`sensor_msgs/msg/PointCloud2` as a structured numpy array, and back."""

from __future__ import annotations

from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header

_NUMBERS: Final = {
    PointField.INT8: "i1", PointField.UINT8: "u1", PointField.INT16: "i2", PointField.UINT16: "u2", PointField.INT32: "i4",
    PointField.UINT32: "u4", PointField.FLOAT32: "f4", PointField.FLOAT64: "f8", PointField.INT64: "i8", PointField.UINT64: "u8",
    PointField.BOOL: "b1",
}  # fmt: skip
_KINDS: Final = {np.dtype(number): kind for kind, number in _NUMBERS.items()}


def array_of_cloud(cloud: PointCloud2) -> NDArray[np.void]:
    """The points as records by the names of their fields, ``points["x"]``: shape (width,), or (height, width) for an organised cloud.

    It is a read-only view of the message's data, with the byte order of the cloud. Raises `ValueError` for a field of an unknown type and
    for too little data.
    """
    order = ">" if cloud.is_bigendian else "<"
    for field in cloud.fields:
        if field.datatype not in _NUMBERS:
            raise ValueError(f"the field {field.name!r} of the cloud has the unknown type {field.datatype}")
    formats = [
        (f"{order}{_NUMBERS[one.datatype]}", (one.count,)) if one.count > 1 else f"{order}{_NUMBERS[one.datatype]}"
        for one in cloud.fields
    ]
    record = np.dtype(
        {
            "names": [one.name for one in cloud.fields],
            "formats": formats,
            "offsets": [one.offset for one in cloud.fields],
            "itemsize": cloud.point_step,
        }
    )
    row = cloud.row_step or cloud.width * cloud.point_step
    if row < cloud.width * cloud.point_step or len(cloud.data) < row * cloud.height:
        raise ValueError(
            f"a cloud of {cloud.height} x {cloud.width} points of {cloud.point_step} bytes in rows of {row} has only "
            f"{len(cloud.data)} bytes"
        )
    shape = (cloud.height, cloud.width)
    points: NDArray[np.void] = np.ndarray(
        shape, record, np.ascontiguousarray(cloud.data).data, 0, (row, cloud.point_step)
    )
    points.setflags(write=False)
    return points[0] if cloud.height == 1 else points


def cloud_of(points: NDArray[Any], header: Header | None = None) -> PointCloud2:
    """A cloud of these records, shape (n,) or, organised, (height, width); or of the columns x, y and z of an array of shape (n, 3).

    Raises `ValueError` for numbers that no field can have.
    """
    if points.dtype.names is None:
        points = _named(points)
    rows = points[None, :] if points.ndim == 1 else points
    if rows.ndim != 2:
        raise ValueError(f"points must have the shape (n,) or (height, width), not {points.shape}")
    fields = tuple(_field(points.dtype, name) for name in points.dtype.names or ())
    little = points.dtype.newbyteorder("<")
    data = np.ascontiguousarray(rows.astype(little)).view(np.uint8).reshape(-1)
    step = little.itemsize
    height, width = rows.shape
    return PointCloud2(
        header=header or Header(), height=height, width=width, fields=fields, point_step=step, row_step=width * step, data=data.copy(),
        is_dense=_is_dense(points),
    )  # fmt: skip


def _named(points: NDArray[np.generic]) -> NDArray[np.void]:
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype not in _KINDS:
        raise ValueError(
            f"points without names must be numbers of the shape (n, 3), not {points.dtype} of {points.shape}"
        )
    record = np.dtype([(name, points.dtype) for name in "xyz"])
    return np.ascontiguousarray(points).view(record).reshape(-1)


def _field(record: np.dtype[np.generic], name: str) -> PointField:
    kind, offset = cast("Any", record.fields)[name][:2]
    base, shape = kind.subdtype or (kind, ())
    datatype = _KINDS.get(base.newbyteorder("="))
    if datatype is None or len(shape) > 1:
        raise ValueError(f"the field {name!r} is {kind}, which no point can have")
    return PointField(name=name, offset=offset, datatype=datatype, count=shape[0] if shape else 1)


def _is_dense(points: NDArray[np.void]) -> bool:
    """Whether every point is finite."""
    floats = (points[name] for name in points.dtype.names or ())
    return all(bool(np.isfinite(one).all()) for one in floats if one.dtype.kind == "f")
