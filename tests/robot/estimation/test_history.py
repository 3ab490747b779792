"""Where the robot was, and how it lay, at the instant of a measurement."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from robot.estimation.history import History, attitude_history, pose_history, started_over
from robot.geometry.planar import Pose2


def history(*poses: tuple[float, Pose2]) -> History[Pose2]:
    made = pose_history()
    for stamp, pose in poses:
        made.add(stamp, pose)
    return made


def test_nothing_is_known_before_the_first_pose() -> None:
    assert history().at(0.0) is None
    assert history((1.0, Pose2(1.0, 0.0))).at(0.99) is None


def test_between_two_poses_the_way_is_straight_and_even() -> None:
    poses = history((1.0, Pose2(0.0, 2.0, 0.1)), (1.4, Pose2(4.0, 0.0, 0.5)))
    there = poses.at(1.1)
    assert there is not None
    assert (there.x, there.y, there.yaw) == pytest.approx((1.0, 1.5, 0.2))
    assert poses.at(1.0) == Pose2(0.0, 2.0, 0.1)
    assert poses.at(1.4) == Pose2(4.0, 0.0, 0.5)


def test_the_heading_turns_the_shorter_way_past_half_a_turn() -> None:
    there = history((0.0, Pose2(0.0, 0.0, 3.0)), (1.0, Pose2(0.0, 0.0, -3.0))).at(0.5)
    assert there is not None
    assert abs(there.yaw) == pytest.approx(math.pi)


def test_after_the_newest_pose_it_is_the_newest() -> None:
    assert history((0.0, Pose2(0.0, 0.0)), (1.0, Pose2(1.0, 0.0))).at(7.0) == Pose2(1.0, 0.0)


def test_poses_of_more_than_two_seconds_ago_are_forgotten() -> None:
    poses = history((0.0, Pose2(0.0, 0.0)), (1.0, Pose2(1.0, 0.0)), (2.5, Pose2(2.0, 0.0)))
    assert poses.at(0.5) is None
    assert poses.at(1.0) == Pose2(1.0, 0.0)


def test_a_pose_that_was_overtaken_takes_the_place_of_those_that_overtook_it() -> None:
    poses = history((1.0, Pose2(1.0, 0.0)), (1.2, Pose2(9.0, 0.0)), (1.1, Pose2(1.1, 0.0)))
    assert poses.at(1.2) == Pose2(1.1, 0.0)
    there = poses.at(1.05)
    assert there is not None and there.x == pytest.approx(1.05)
    poses.add(1.1, Pose2(5.0, 0.0))
    assert poses.at(1.1) == Pose2(5.0, 0.0)


def test_after_the_clock_was_set_back_the_history_goes_on_from_there() -> None:
    poses = history((100.0, Pose2(1.0, 0.0)), (101.0, Pose2(2.0, 0.0)), (3.0, Pose2(7.0, 0.0)), (4.0, Pose2(8.0, 0.0)))
    assert poses.at(2.9) is None
    there = poses.at(3.5)
    assert there is not None and there.x == pytest.approx(7.5)


def test_poses_that_do_not_go_on_are_forgotten_when_asked() -> None:
    poses = history((0.0, Pose2(0.0, 0.0)))
    poses.clear()
    assert poses.at(0.0) is None


def test_between_two_attitudes_the_body_turns_evenly_whatever_the_signs_of_their_quaternions() -> None:
    turns = Rotation.from_euler("zyx", [[10.0, 2.0, -3.0], [14.0, -1.0, 1.0]], degrees=True)
    first, last = (np.roll(one.as_quat(), 1) for one in turns)
    lay = attitude_history()
    lay.add(1.0, (first, 0.4))
    lay.add(1.2, (-last, 0.5))
    there = lay.at(1.05)
    assert there is not None
    attitude, height = there
    expected = Slerp([0.0, 1.0], turns)(0.25)
    told = Rotation.from_quat(np.roll(attitude, -1))
    assert (expected.inv() * told).magnitude() == pytest.approx(0.0, abs=1e-4)
    assert height == pytest.approx(0.425)


def test_odometry_has_started_over_when_it_went_farther_than_the_robot_can() -> None:
    assert started_over((0.0, 0.0), (0.4, -0.2), 0.0)
    assert not started_over((0.0, 0.0), (0.4, -0.05), 0.0)
    assert not started_over((0.0, 0.0), (1.5, 0.9), 1.0)  # it was not heard of for a second
    assert started_over((0.0, 0.0), (1.5, 1.1), 1.0)
    assert started_over((0.0, 0.0), (0.6, 0.0), -100.0)  # the clock was set back
