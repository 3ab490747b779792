"""The node that tells odometry of its heading, and the gait that heeds it."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from actors import Child
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Float64, Header
from actors.testing import Rig
from actors.time import stamp_of
from robot.assembly import Robot
from robot.contracts import HEADING_ERROR, ODOMETRY, SCAN
from robot.geometry.messages import from_pose, to_pose
from robot.geometry.planar import Pose2
from robot.nodes.heading import Heading
from robot.run.tree_nodes import only
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast
from tests.robot.stage import floor

HERE = Pose2(0.0, 0.5)
WAREHOUSE = get_world("warehouse")


def tell(rig: Rig, now: float, odom: Pose2) -> None:
    """Odometry at an instant, and a scan of it from one and the same place."""
    header = Header(stamp=stamp_of(round(now * 1e9)))
    rig.publish(ODOMETRY, Odometry(header=header, pose=Odometry().pose.replace(pose=to_pose(odom))))
    rig.publish(SCAN, LaserScan(header=header, range_max=10.0, ranges=cast(WAREHOUSE, HERE.x, HERE.y, HERE.yaw)))


async def test_five_times_a_second_it_tells_how_far_odometry_has_turned_away(rig: Rig) -> None:
    await rig.start(Child(Heading))
    errors = rig.probe(HEADING_ERROR)
    for step in range(100):
        tell(rig, 1.0 + 0.1 * step, Pose2(0.0, 0.0, 0.0002 * step))
        await rig.quiet()
    assert len(errors) == 49
    assert errors[-1].data == pytest.approx(0.0002 * 98, abs=1e-3)


async def test_odometry_that_begins_anew_is_right_from_there(rig: Rig) -> None:
    await rig.start(Child(Heading))
    errors = rig.probe(HEADING_ERROR)
    for step in range(10):
        tell(rig, 1.0 + 0.2 * step, Pose2(5.0, 3.0, 0.001 * step))
        await rig.quiet()
    assert errors[-1].data > 5e-3
    errors.clear()
    for step in range(3):
        tell(rig, 3.0 + 0.2 * step, Pose2(0.0, 0.0, 0.5))
        await rig.quiet()
    assert [message.data for message in errors] == pytest.approx([0.0, 0.0], abs=1e-3)


async def test_the_gait_turns_its_odometry_slowly_and_drops_what_is_no_number(rig: Rig) -> None:
    robot = Robot(floor(), body="kinematic", seed=1, motor_delay=0.0)
    await rig.start(only(robot.tree, ("motors", "proprioception", "gait")))
    told = rig.probe(ODOMETRY)
    await rig.advance(1.0)
    before = from_pose(told[-1].pose.pose).yaw
    rig.publish(HEADING_ERROR, Float64(data=math.nan))
    for _ in range(10):
        rig.publish(HEADING_ERROR, Float64(data=0.01))
        await rig.advance(0.2)
    yaws = [from_pose(message.pose.pose).yaw for message in told]
    assert yaws[-1] - before == pytest.approx(-2.0 * 0.01 * 0.3, abs=2e-3)
    assert max(abs(b - a) for a, b in pairwise(yaws)) < 1e-3
