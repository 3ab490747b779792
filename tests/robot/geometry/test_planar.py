"""Poses on the floor against 3 x 3 matrices, and their way through messages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, Quaternion
from robot.geometry.messages import from_pose, pose_stamped, seconds, to_pose
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose, inverse, placed, seen_from, turned, turned_back

numbers = st.floats(-100.0, 100.0)
poses = st.builds(Pose2, numbers, numbers, st.floats(-math.pi, math.pi, exclude_min=True))


def matrix(pose: Pose2) -> np.ndarray:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array(((c, -s, pose.x), (s, c, pose.y), (0.0, 0.0, 1.0)))


@given(poses, poses)
def test_composing_is_the_product_of_matrices(a: Pose2, b: Pose2) -> None:
    both = compose(a, b)
    assert matrix(both) == pytest.approx(matrix(a) @ matrix(b), abs=1e-9)
    assert -math.pi < both.yaw <= math.pi


@given(poses)
def test_the_inverse_is_that_of_the_matrix_and_undoes_it_from_both_sides(a: Pose2) -> None:
    assert matrix(inverse(a)) == pytest.approx(np.linalg.inv(matrix(a)), abs=1e-9)
    for whole in (compose(a, inverse(a)), compose(inverse(a), a)):
        assert (whole.x, whole.y, whole.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@given(poses, poses, poses)
def test_the_order_of_brackets_makes_no_difference(a: Pose2, b: Pose2, c: Pose2) -> None:
    left, right = compose(compose(a, b), c), compose(a, compose(b, c))
    assert matrix(left) == pytest.approx(matrix(right), abs=1e-8)


@given(poses, poses)
def test_points_and_vectors_are_turned_as_poses_are(frame: Pose2, point: Pose2) -> None:
    there = compose(frame, point)
    assert placed(frame, point.x, point.y) == pytest.approx((there.x, there.y))
    assert seen_from(frame, there.x, there.y) == pytest.approx((point.x, point.y), abs=1e-6)
    assert turned_back(frame.yaw, *turned(frame.yaw, point.x, point.y)) == pytest.approx((point.x, point.y), abs=1e-6)
    many = placed(frame, np.array([point.x, 0.0]), np.array([point.y, 1.0]))
    assert [float(axis[0]) for axis in many] == list(placed(frame, point.x, point.y))
    assert turned(math.pi / 2, 1.0, 0.0) == pytest.approx((0.0, 1.0))


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-2.0, 2.0), st.floats(0.0, 0.02))
def test_a_twist_leads_along_its_exact_motion_to_first_order(vx: float, vy: float, wz: float, time: float) -> None:
    """The exact one is the exponential of the twist's matrix."""
    exact = expm(time * np.array(((0.0, -wz, vx), (wz, 0.0, vy), (0.0, 0.0, 0.0))))
    led = Twist2(vx, vy, wz).over(time)
    assert (led.x, led.y) == pytest.approx(tuple(exact[:2, 2]), abs=1.5 * time * time + 1e-12)
    assert led.yaw == pytest.approx(wz * time)


def test_at_rest_nothing_moves() -> None:
    assert ZERO_TWIST.over(10.0) == Pose2(0.0, 0.0, 0.0)
    assert Twist2(1.0, -0.5, 0.2).over(0.5) == Pose2(0.5, -0.25, 0.1)


@given(poses)
def test_a_pose_comes_back_from_its_message(pose: Pose2) -> None:
    message = to_pose(pose)
    back = from_pose(message)
    assert (back.x, back.y) == (pose.x, pose.y)
    assert math.cos(back.yaw - pose.yaw) == pytest.approx(1.0)
    q = message.orientation
    assert Rotation.from_quat((q.x, q.y, q.z, q.w)).as_matrix() == pytest.approx(
        Rotation.from_euler("z", pose.yaw).as_matrix()
    )


@given(st.floats(-3.0, 3.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_of_a_tilted_pose_the_yaw_is_kept_and_the_height_dropped(yaw: float, pitch: float, roll: float) -> None:
    x, y, z, w = Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_quat().tolist()
    floor = from_pose(Pose(position=Point(x=1.0, y=2.0, z=9.0), orientation=Quaternion(x=x, y=y, z=z, w=w)))
    assert (floor.x, floor.y) == (1.0, 2.0)
    assert floor.yaw == pytest.approx(yaw, abs=1e-9)


def test_a_stamped_pose_has_its_time_and_frame_and_a_time_its_seconds() -> None:
    stamp = Time(sec=12, nanosec=250_000_000)
    message = pose_stamped(Pose2(1.0, 2.0, 0.0), stamp)
    assert (message.header.frame_id, message.header.stamp, message.pose.position.y) == ("map", stamp, 2.0)
    assert pose_stamped(Pose2(0.0, 0.0), stamp, "odom").header.frame_id == "odom"
    assert seconds(stamp) == 12.25
