"""The camera's pinhole against the intrinsic matrix that it publishes, and against its angles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.std_msgs.msg import Header
from robot.hardware.lens import CX, CY, FOCAL, HEIGHT, WIDTH, camera_info, column_slopes, deproject, project, row_slopes

ahead = st.floats(0.05, 20.0)
aside = st.floats(-3.0, 3.0)
INFO = camera_info(Header(frame_id="camera"))


@given(ahead, aside, aside)
def test_a_point_is_where_the_published_matrix_puts_it(x: float, y: float, z: float) -> None:
    """The matrix is for optical axes: z forward, x right, y down."""
    column, row, scale = INFO.k.reshape(3, 3) @ (-y, -z, x)
    assert project(x, y, z) == pytest.approx((column / scale, row / scale))
    homogeneous = INFO.p.reshape(3, 4) @ (-y, -z, x, 1.0)
    assert homogeneous[:2] / homogeneous[2] == pytest.approx((column / scale, row / scale))


@given(ahead, aside, aside)
def test_a_pixel_and_its_depth_give_the_point_back(x: float, y: float, z: float) -> None:
    assert deproject(*project(x, y, z), x) == pytest.approx((x, y, z), abs=1e-9)


def test_the_edges_of_the_picture_are_seventy_degrees_apart() -> None:
    left, right = (math.atan((CX - edge) / FOCAL) for edge in (-0.5, WIDTH - 0.5))
    assert left - right == pytest.approx(math.radians(70.0))
    assert left == pytest.approx(-right)


def test_the_point_straight_ahead_is_in_the_middle_and_left_and_up_are_left_and_up() -> None:
    assert project(2.0, 0.0, 0.0) == ((WIDTH - 1) / 2, (HEIGHT - 1) / 2) == (CX, CY)
    column, row = project(2.0, 0.5, 0.3)
    assert column < CX
    assert row < CY


@pytest.mark.parametrize("x", [0.0, -1.0])
def test_what_is_not_in_front_of_the_camera_has_no_place_in_the_picture(x: float) -> None:
    with pytest.raises(ValueError, match="is not in front of the camera"):
        project(x, 0.1, 0.1)


def test_every_column_and_row_looks_where_its_pixel_is() -> None:
    columns, rows = column_slopes(), row_slopes()
    assert (columns.shape, rows.shape) == ((WIDTH,), (HEIGHT,))
    for column in (0, 17, WIDTH - 1):
        assert columns[column] == pytest.approx(deproject(column, 0.0, 1.0)[1])
    for row in (0, 99, HEIGHT - 1):
        assert rows[row] == pytest.approx(deproject(0.0, row, 1.0)[2])
    assert columns == pytest.approx(-columns[::-1])
    assert np.diff(rows) == pytest.approx(np.full(HEIGHT - 1, -1.0 / FOCAL))


def test_the_info_has_no_distortion_and_the_size_of_the_picture() -> None:
    assert (INFO.width, INFO.height, INFO.distortion_model) == (640, 480, "plumb_bob")
    assert INFO.d.tolist() == [0.0] * 5
    assert INFO.r.reshape(3, 3).tolist() == np.eye(3).tolist()
    assert INFO.header.frame_id == "camera"
