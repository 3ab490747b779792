"""Point clouds as structured arrays and back."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

from actors.images import array_of_cloud, cloud_of
from actors.interfaces.sensor_msgs.msg import PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header

POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("ring", "<u2"), ("intensity", "<f8")])


def test_points_without_names_are_x_y_and_z() -> None:
    cloud = cloud_of(np.array([[1, 2, 3], [4, 5, 6]], np.float32), Header(frame_id="lidar"))
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 2, 12, 24) and cloud.is_dense
    assert [(one.name, one.offset, one.datatype, one.count) for one in cloud.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
    ]
    assert bytes(cloud.data) == struct.pack("<6f", 1, 2, 3, 4, 5, 6) and cloud.header.frame_id == "lidar"


def test_records_keep_names_types_and_values() -> None:
    points = np.array([(1, 2, 3, 4, 0.5), (5, 6, 7, 8, 0.25)], POINT)
    cloud = cloud_of(points)
    assert [one.datatype for one in cloud.fields] == [PointField.FLOAT32] * 3 + [PointField.UINT16, PointField.FLOAT64]
    back = array_of_cloud(cloud)
    assert back.dtype == POINT and np.array_equal(back, points) and not back.flags.writeable
    assert back["ring"].tolist() == [4, 8]


def test_an_organised_cloud_has_rows() -> None:
    points = np.zeros((2, 3), POINT)
    points["z"] = [[1, 2, 3], [4, 5, np.nan]]
    cloud = cloud_of(points)
    assert (cloud.height, cloud.width, cloud.is_dense) == (2, 3, False)
    assert array_of_cloud(cloud)["z"][0].tolist() == [1, 2, 3] and array_of_cloud(cloud).shape == (2, 3)


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8", "b1"])
def test_every_type_of_a_field_is_kept(kind: str) -> None:
    points = np.array([(1,), (0,)], [("a", kind)])
    assert array_of_cloud(cloud_of(points))["a"].tolist() == points["a"].tolist()


def test_fields_of_several_numbers_gaps_and_the_other_byte_order() -> None:
    points = np.array([((1, 2, 3), 9)], [("normal", "f4", (3,)), ("label", "u1")])
    cloud = cloud_of(points)
    assert cloud.fields[0].count == 3 and array_of_cloud(cloud)["normal"].tolist() == [[1, 2, 3]]
    data = np.frombuffer(struct.pack(">f4xH6x", 1.5, 7) + struct.pack(">f4xH6x", 2.5, 8), np.uint8)
    fields = (
        PointField(name="x", datatype=PointField.FLOAT32, count=1),
        PointField(name="r", offset=8, datatype=PointField.UINT16),
    )
    strange = PointCloud2(height=1, width=2, fields=fields, is_bigendian=True, point_step=16, data=data)
    read = array_of_cloud(strange)
    assert read["x"].tolist() == [1.5, 2.5] and read["r"].tolist() == [7, 8]
    assert array_of_cloud(cloud_of(read))["x"].tolist() == [1.5, 2.5]


def test_an_empty_cloud_is_read() -> None:
    assert len(array_of_cloud(cloud_of(np.zeros((0, 3), np.float64)))) == 0


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (np.zeros((2, 4), np.float32), r"of the shape \(n, 3\), not float32 of \(2, 4\)"),
        (np.zeros((2, 3), np.complex64), "not complex64"),
        (np.zeros((2, 2, 2), POINT), r"the shape \(n,\) or \(height, width\)"),
        (np.zeros(2, [("name", "U3")]), "the field 'name' is <U3, which no point can have"),
        (np.zeros(2, [("matrix", "f4", (2, 2))]), "the field 'matrix'"),
    ],
)
def test_what_no_cloud_can_hold_is_refused(points: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        cloud_of(points)


def test_a_cloud_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="the field 'x' of the cloud has the unknown type 99"):
        array_of_cloud(PointCloud2(fields=(PointField(name="x", datatype=99),)))
    field = (PointField(name="x", datatype=PointField.FLOAT32, count=1),)
    with pytest.raises(ValueError, match="a cloud of 1 x 3 points of 4 bytes in rows of 12 has only 8 bytes"):
        array_of_cloud(PointCloud2(height=1, width=3, fields=field, point_step=4, row_step=12, data=[0] * 8))
    with pytest.raises(ValueError, match="in rows of 8"):
        array_of_cloud(PointCloud2(height=1, width=3, fields=field, point_step=4, row_step=8, data=[0] * 12))
