"""Vectors between body and ground against numpy, and the yaw of an attitude against scipy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.angles import yaw_of
from robot.geometry.vectors import Rows, to_body, to_ground, wrap_all

numbers = st.floats(-100.0, 100.0)
triples = st.tuples(numbers, numbers, numbers)
rotations = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3))).map(Rotation.from_rotvec)


def rows(rotation: Rotation) -> Rows:
    a, b, c = (tuple(row) for row in rotation.as_matrix().tolist())
    return (a, b, c)


@given(rotations, triples)
def test_to_the_ground_by_the_matrix_and_to_the_body_by_its_transpose(
    rotation: Rotation, vector: tuple[float, float, float]
) -> None:
    assert to_ground(rows(rotation), vector) == pytest.approx(rotation.as_matrix() @ vector, abs=1e-9)
    assert to_body(rows(rotation), vector) == pytest.approx(rotation.as_matrix().T @ vector, abs=1e-9)


@given(triples, triples, triples, triples)
def test_any_matrix_is_multiplied_not_only_rotations(a: tuple, b: tuple, c: tuple, vector: tuple) -> None:
    matrix = np.array((a, b, c))
    assert to_ground((a, b, c), vector) == pytest.approx(matrix @ vector, rel=1e-9, abs=1e-6)
    assert to_body((a, b, c), vector) == pytest.approx(matrix.T @ vector, rel=1e-9, abs=1e-6)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_the_yaw_is_the_first_of_scipys_turns_about_z_y_and_x(yaw: float, pitch: float, roll: float) -> None:
    x, y, z, w = Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_quat().tolist()
    assert yaw_of(w, x, y, z) == pytest.approx(yaw, abs=1e-6)
    assert yaw_of(-w, -x, -y, -z) == pytest.approx(yaw, abs=1e-6), "the other quaternion of the same attitude"


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=20))
def test_many_angles_are_wrapped_to_the_same_directions(angles: list[float]) -> None:
    wrapped = wrap_all(np.array(angles))
    assert np.abs(wrapped).max() <= math.pi + 1e-12
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * np.array(angles)), abs=1e-9)
