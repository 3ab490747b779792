"""A scan tells of the instant at which it was taken: a robot that has turned since then is not led astray by it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from actors import Child, Done, Node, Steps
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger_Request, Trigger_Response
from actors.testing import Rig
from robot.contracts import AUTONOMY_CMD, DOCK, GAIT_STATUS, NAVIGATE_TO_POSE, ODOMETRY, POSE, SCAN, WALK
from robot.geometry.messages import from_pose, pose_stamped, to_pose
from robot.geometry.planar import Pose2, compose, inverse
from robot.interfaces.nav2_msgs.action import (
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from robot.interfaces.robactor_msgs.action import Dock
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.nodes.docking import Docking
from robot.nodes.goal_walk import Heard
from robot.nodes.localizer import Localizer
from robot.planning.grid import Grid
from robot.scenes.dock import BEFORE
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast
from tests.robot.stage import apart, twist

WAREHOUSE = get_world("warehouse")
TURNING = 0.3
"""rad/s."""
LATE = 4
"""Rounds of 50 ms: 0.2 s, in which the robot turns by 0.06 rad."""


def scan_of(pose: Pose2, stamp: Time) -> LaserScan:
    return LaserScan(
        header=Header(stamp=stamp, frame_id="lidar_link"), ranges=cast(WAREHOUSE, pose.x, pose.y, pose.yaw)
    )


async def turning(
    rig: Rig, start: Pose2, tell: Callable[[Pose2, Time], None], over: Callable[[], bool], most: int = 80
) -> Pose2:
    """The robot turns on the spot and tells where it is at once; each scan of it comes 0.2 s after it was taken."""
    scans: list[LaserScan] = []
    here = start
    for number in range(most):
        here = Pose2(start.x, start.y, start.yaw + TURNING * 0.05 * number)
        stamp = rig.me.clock.stamp()
        tell(here, stamp)
        scans.append(scan_of(here, stamp))
        if number >= LATE:
            rig.publish(SCAN, scans[number - LATE])
        await rig.advance(0.05)
        if over():
            break
    return here


class Obliging(Node):
    """Navigation and gait of a robot that is in front of its dock already and walks when it is asked to."""

    @NAVIGATE_TO_POSE.serve()
    async def navigate(self, goal: NavigateToPose_Goal) -> Steps[NavigateToPose_Feedback, NavigateToPose_Result]:
        yield Done(NavigateToPose.Result())

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger_Response(success=True)


async def test_the_station_is_where_a_late_scan_saw_it_from_where_the_robot_was_then(rig: Rig) -> None:
    await rig.start(Obliging, Child(Docking, args=(WAREHOUSE.dock, True)))
    start = compose(WAREHOUSE.dock, Pose2(BEFORE.x, BEFORE.y, -0.35))
    rig.publish(POSE, pose_stamped(start, rig.me.clock.stamp()))
    rig.publish(GAIT_STATUS, GaitStatus(mode="walk", goal="walk"))
    await rig.advance(0.01)
    commands = rig.probe(AUTONOMY_CMD)
    await rig.send_goal(DOCK, Dock.Goal())

    def tell(here: Pose2, stamp: Time) -> None:
        rig.publish(POSE, pose_stamped(here, stamp))

    here = await turning(rig, start, tell, lambda: len(commands) > 0)

    first = commands[0]
    place = compose(inverse(WAREHOUSE.dock), here)
    assert first.angular.z == pytest.approx(-1.5 * place.yaw, abs=0.02), "the map was right all the time"


async def test_late_scans_do_not_turn_the_robots_idea_of_where_it_is(rig: Rig) -> None:
    start = WAREHOUSE.start
    await rig.start(Child(Localizer, args=(Grid.from_scene(WAREHOUSE), start)))
    poses = rig.probe(POSE)

    def tell(here: Pose2, stamp: Time) -> None:
        odometry = Odometry(
            header=Header(stamp=stamp, frame_id="odom"),
            pose=PoseWithCovariance(pose=to_pose(compose(inverse(start), here))),
            twist=TwistWithCovariance(twist=twist(wz=TURNING)),
        )
        rig.publish(ODOMETRY, odometry)

    here = await turning(rig, start, tell, lambda: False, most=60)

    assert poses.last is not None
    believed = from_pose(poses.last.pose)
    assert apart(believed, here) < 0.01
    assert believed.yaw == pytest.approx(here.yaw, abs=0.01)


def test_a_walk_takes_a_scan_once_and_from_where_the_robot_was_when_it_was_taken() -> None:
    heard = Heard()
    for tenth in range(4):
        heard.poses.add(0.1 * tenth, Pose2(0.1 * tenth, 0.0))
    heard.scan = LaserScan(header=Header(stamp=Time(nanosec=150_000_000)), ranges=[1.0, 2.0])
    ranges, taken_at = heard.take_scan()
    assert ranges is not None and ranges.tolist() == [1.0, 2.0]
    assert taken_at is not None and (taken_at.x, taken_at.y) == pytest.approx((0.15, 0.0))
    assert heard.take_scan() == (None, None)


def test_a_scan_from_before_all_known_poses_is_left_out() -> None:
    heard = Heard()
    heard.poses.add(5.0, Pose2(0.0, 0.0))
    heard.scan = LaserScan(header=Header(stamp=Time(sec=4)), ranges=np.ones(4))
    assert heard.take_scan() == (None, None)
