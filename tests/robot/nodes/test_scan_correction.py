"""Scans of a LiDAR that turns, from the body to those who use them, in a running robot."""

from __future__ import annotations

import numpy as np
import pytest

from actors import Child
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from actors.time import stamp_of
from robot.assembly import Robot
from robot.contracts import ODOMETRY, SCAN, SCAN_RAW
from robot.geometry.messages import seconds
from robot.hardware.sensors import LidarErrors, Sensors
from robot.nodes.scan_correction import ScanCorrection
from robot.run.tree_nodes import nodes_of

TURNING = Sensors(lidar=LidarErrors(sweep=0.1))


def odometry(stamp: float, x: float = 0.0) -> Odometry:
    place = Pose(position=Point(x=x, z=0.5), orientation=Quaternion(w=1.0))
    return Odometry(header=Header(stamp=stamp_of(round(stamp * 1e9))), pose=PoseWithCovariance(pose=place))


def sweep(start: float) -> LaserScan:
    header = Header(stamp=stamp_of(round(start * 1e9)), frame_id="base_link")
    ranges = np.full(360, 4.0)
    return LaserScan(header=header, scan_time=0.1, time_increment=0.1 / 360, range_max=10.0, ranges=ranges)


def test_a_robot_with_a_turning_lidar_has_one_node_more_and_one_with_an_ideal_one_has_not() -> None:
    ideal, real = (
        {child.name: child.factory for child in nodes_of(Robot("warehouse", body="kinematic", sensors=sensors).tree)}
        for sensors in (None, TURNING)
    )
    assert real.keys() - ideal.keys() == {"scan_correction"}
    assert ideal.keys() <= real.keys()


async def test_ten_corrected_scans_a_second_reach_those_who_listen(rig: Rig) -> None:
    robot = Robot("warehouse", body="kinematic", sensors=TURNING)
    await rig.start(robot.tree)
    raw, scans = rig.probe(SCAN_RAW), rig.probe(SCAN)
    await rig.advance(2.05)
    assert len(raw) == 20
    assert 18 <= len(scans) <= 20
    first, last = scans[0], scans[-1]
    assert first.header.frame_id == "lidar_link"
    assert first.time_increment == 0.0
    period = seconds(last.header.stamp) - seconds(first.header.stamp)
    assert period == pytest.approx(0.1 * (len(scans) - 1), abs=0.01)
    body = Robot("warehouse", body="kinematic").body
    body.advance(0.1)
    level = body.lidar()
    told = last.ranges.astype(float)
    known = told > 0.0
    assert known.mean() > 0.9
    assert np.median(np.abs(told - level)[known]) < 0.03


async def test_a_sweep_waits_for_the_odometry_of_its_end(rig: Rig) -> None:
    await rig.start(Child(ScanCorrection))
    scans = rig.probe(SCAN)
    for step in range(5):
        rig.publish(ODOMETRY, odometry(1.0 + 0.02 * step))
    rig.publish(SCAN_RAW, sweep(1.0))
    await rig.quiet()
    assert not scans
    rig.publish(ODOMETRY, odometry(1.1))
    await rig.quiet()
    assert [seconds(scan.header.stamp) for scan in scans] == [pytest.approx(1.1)]


async def test_odometry_that_begins_anew_corrects_no_sweep_of_before(rig: Rig) -> None:
    await rig.start(Child(ScanCorrection))
    scans = rig.probe(SCAN)
    for step in range(6):
        rig.publish(ODOMETRY, odometry(1.0 + 0.02 * step, x=5.0 if step == 3 else 0.0))
    rig.publish(SCAN_RAW, sweep(1.0))
    await rig.quiet()
    assert not scans
    for step in range(7):
        rig.publish(ODOMETRY, odometry(1.12 + 0.02 * step))
    rig.publish(SCAN_RAW, sweep(1.12))
    await rig.quiet()
    assert len(scans) == 1
