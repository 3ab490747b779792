"""Somebody tells the robot where it is, as rviz and nav2 do."""

from __future__ import annotations

import numpy as np
import pytest

from actors.interfaces.geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from robot import Robot
from robot.contracts import INITIAL_POSE, LOCALIZATION, POSE
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose, to_pose
from robot.geometry.planar import Pose2
from robot.hardware.sensors import Sensors

TRUE, MIRRORED = Pose2(5.0, 2.0, 0.4), Pose2(-1.0, -2.0, 0.4 - np.pi)
"""The walls of the kitchen look the same from both."""


def told(pose: Pose2, frame: str = "map", sd: float = 0.25) -> PoseWithCovarianceStamped:
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = sd**2, sd**2, 0.1**2
    return PoseWithCovarianceStamped(
        header=Header(frame_id=frame), pose=PoseWithCovariance(pose=to_pose(pose), covariance=covariance)
    )


async def carried(rig: Rig, to: Pose2) -> Robot:
    robot = Robot("kitchen", body="kinematic", sensors=Sensors.real(), seed=2)
    await rig.start(robot.tree)
    await rig.advance(2.0)
    robot.body.place(to)
    return robot


async def test_places_that_are_alike_are_said_to_be_and_nobody_guesses(rig: Rig) -> None:
    await carried(rig, TRUE)
    states = rig.probe(LOCALIZATION)
    await rig.until(lambda: bool(states) and states.newest.data == "ambiguous", within=10.0)
    await rig.advance(2.0)
    assert states.newest.data == "ambiguous"


@pytest.mark.parametrize("where", [MIRRORED, pytest.param(TRUE, marks=pytest.mark.slow(reason="a second walk"))])
async def test_who_is_told_about_where_it_is_finds_itself_there_and_not_at_the_other_end(
    rig: Rig, where: Pose2
) -> None:
    await carried(rig, where)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await rig.advance(4.0)
    rig.publish(INITIAL_POSE, told(Pose2(where.x + 0.4, where.y - 0.4, where.yaw + 0.15)))
    await rig.advance(3.0)
    here = from_pose(poses.newest.pose)
    assert (here.x, here.y) == pytest.approx((where.x, where.y), abs=0.03)
    assert wrap(here.yaw - where.yaw) == pytest.approx(0.0, abs=0.02)
    assert states.newest.data == "tracking"


async def test_an_initial_pose_in_another_frame_is_refused_with_a_line(rig: Rig) -> None:
    await rig.start(Robot("kitchen", body="kinematic").tree)
    poses = rig.probe(POSE)
    await rig.advance(1.0)
    rig.publish(INITIAL_POSE, told(TRUE, frame="base_link"))
    rig.publish(INITIAL_POSE, told(Pose2(float("nan"), 0.0)))
    await rig.advance(1.0)
    assert from_pose(poses.newest.pose).x == pytest.approx(0.0, abs=0.1)
    assert len([line for _, line in rig.lines() if "an initial pose that is none" in line]) == 2


async def test_before_the_first_odometry_it_is_where_the_robot_starts(rig: Rig) -> None:
    """As a robot that is switched on somewhere in its hall: told at once, it never believes to be elsewhere."""
    robot = Robot("warehouse", body="kinematic", seed=2)
    robot.body.place(Pose2(8.8, 3.4, 2.0))
    await rig.start(robot.tree)
    poses = rig.probe(POSE)
    rig.publish(INITIAL_POSE, told(Pose2(8.6, 3.5, 1.9)))
    await rig.advance(2.0)
    assert from_pose(poses.newest.pose).x == pytest.approx(8.8, abs=0.03)
