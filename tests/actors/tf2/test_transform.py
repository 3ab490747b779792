"""Transforms against scipy's rotations and 4 x 4 matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from actors.interfaces.builtin_interfaces.msg import Time
from actors.tf2 import InvalidArgumentException, Transform, TransformException, stamped
from actors.tf2.quaternions import Quad

numbers = st.floats(-50.0, 50.0)
triples = st.tuples(numbers, numbers, numbers)
turns = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3)))


def made(translation: tuple[float, float, float], turn: tuple[float, float, float]) -> Transform:
    x, y, z, w = Rotation.from_rotvec(turn).as_quat().tolist()
    return Transform(translation, (w, x, y, z))


transforms = st.builds(made, triples, turns)


def matrix(transform: Transform) -> np.ndarray:
    """4 x 4, by scipy."""
    w, x, y, z = transform.rotation
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_quat((x, y, z, w)).as_matrix(), transform.translation
    return whole


@given(transforms)
def test_the_rotation_matrix_is_scipys(one: Transform) -> None:
    assert one.matrix == pytest.approx(matrix(one)[:3, :3], abs=1e-12)


@given(transforms, transforms)
def test_putting_together_and_turning_round_are_product_and_inverse_of_matrices(
    one: Transform, other: Transform
) -> None:
    assert matrix(one @ other) == pytest.approx(matrix(one) @ matrix(other), abs=1e-9)
    assert matrix(one.inverse()) == pytest.approx(np.linalg.inv(matrix(one)), abs=1e-9)


@given(transforms, st.lists(triples, min_size=1, max_size=5))
def test_points_go_across_one_by_one_and_many_at_once(one: Transform, points: list[tuple[float, float, float]]) -> None:
    truth = (matrix(one) @ np.column_stack((points, np.ones(len(points)))).T).T[:, :3]
    assert one.points(points) == pytest.approx(truth, abs=1e-9)
    assert [one.point(point) for point in points] == [pytest.approx(row, abs=1e-9) for row in truth]


@given(transforms, transforms, st.floats(0.0, 1.0))
def test_between_two_poses_the_way_is_straight_and_the_turn_scipys_slerp(
    one: Transform, other: Transform, share: float
) -> None:
    first, last = (Rotation.from_matrix(matrix(pose)[:3, :3]) for pose in (one, other))
    assume((first.inv() * last).magnitude() < math.pi - 1e-3)
    between = one.towards(other, share)
    turned = Slerp((0.0, 1.0), Rotation.concatenate((first, last)))(share)
    assert matrix(between)[:3, :3] == pytest.approx(turned.as_matrix(), abs=1e-6)
    assert between.translation == pytest.approx(
        (1 - share) * np.array(one.translation) + share * np.array(other.translation)
    )


@given(transforms)
def test_of_two_quaternions_for_one_rotation_the_nearer_is_taken(one: Transform) -> None:
    negated = Transform(one.translation, tuple(-part for part in one.rotation))
    assert matrix(one.towards(negated, 0.5)) == pytest.approx(matrix(one), abs=1e-9)


def test_a_tiny_turn_is_blended_without_dividing_by_nothing() -> None:
    here, there = Transform(), made((0.0, 0.0, 0.0), (0.0, 0.0, 1e-6))
    assert here.towards(there, 0.25).rotation[3] == pytest.approx(0.125e-6)
    assert here.towards(here, 0.5) == here


@given(numbers, numbers, st.floats(-3.0, 3.0))
def test_on_the_floor_it_turns_about_the_vertical(x: float, y: float, yaw: float) -> None:
    planar = Transform.planar(x, y, yaw)
    assert planar.matrix == pytest.approx(Rotation.from_euler("z", yaw).as_matrix(), abs=1e-12)
    assert planar.translation == (x, y, 0.0)


@given(transforms)
def test_through_a_message_it_comes_back_and_a_long_chain_stays_a_rotation(one: Transform) -> None:
    again = Transform.from_msg(one.to_msg())
    assert again.translation == one.translation
    assert again.rotation == pytest.approx(one.rotation)
    chain = one
    for _ in range(50):
        chain = chain @ one
    assert math.hypot(*chain.rotation) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("told", "taken"),
    [
        ((0.7, 0.0, 0.0, 0.7), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))),
        ((0.5, 0.0, 0.0, 0.5), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))),
        ((0.0, 0.0, 0.0, 2.0), (0.0, 0.0, 0.0, 1.0)),
        ((1e-3, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        ((1e200, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_a_quaternion_of_another_length_is_brought_to_length_1_as_in_tf2(told: Quad, taken: Quad) -> None:
    assert Transform.from_msg(Transform(rotation=told).to_msg()).rotation == pytest.approx(taken, abs=1e-12)


@pytest.mark.parametrize("off", [0.0, 1e-9, math.inf, math.nan])
def test_a_quaternion_without_a_direction_is_a_mistake(off: float) -> None:
    wrong = Transform((1.0, 2.0, 3.0), (off, 0.0, 0.0, 0.0)).to_msg()
    with pytest.raises(InvalidArgumentException, match=r"translation \(1, 2, 3\).*rotation not of length"):
        Transform.from_msg(wrong)
    assert issubclass(InvalidArgumentException, TransformException) and issubclass(InvalidArgumentException, ValueError)


def test_rounding_is_no_mistake_and_is_taken_out() -> None:
    read = Transform.from_msg(Transform((0.0, 0.0, 0.0), (0.9955, 0.0, 0.0, 0.0)).to_msg())
    assert read.rotation == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_none_are_refused(bad: float) -> None:
    for place in range(3):
        translation = tuple(bad if axis == place else 0.0 for axis in range(3))
        with pytest.raises(InvalidArgumentException, match="finite"):
            Transform.from_msg(Transform(translation).to_msg())
    with pytest.raises(InvalidArgumentException):
        Transform.from_msg(Transform(rotation=(bad, 0.0, 0.0, 0.0)).to_msg())


def test_a_stamped_message_says_whose_place_it_is_in_what_and_when() -> None:
    stamp = Time(sec=3, nanosec=5)
    message = stamped("map", "odom", Transform((1.0, 2.0, 3.0)), stamp)
    assert (message.header.frame_id, message.child_frame_id, message.header.stamp) == ("map", "odom", stamp)
    assert (message.transform.translation.y, message.transform.rotation.w) == (2.0, 1.0)
