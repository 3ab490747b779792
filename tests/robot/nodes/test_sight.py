"""The nodes that see: depth cameras over a body, and the elevation map over what they and the LiDAR tell."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from actors import Child
from actors.images import array_of_cloud
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion
from actors.interfaces.nav_msgs.msg import OccupancyGrid, Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from robot.contracts import DEPTH_POINTS, ELEVATION_POINTS, GAIT_STATUS, ODOMETRY, POSE, RELIEF, SCAN
from robot.estimation.elevation import FREE, UNSEEN, UPRIGHT, WALL
from robot.geometry.messages import pose_stamped, seconds
from robot.geometry.planar import Pose2
from robot.hardware.depth import eyes
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.model.modes import Mode
from robot.nodes.depth import DepthCameras
from robot.nodes.elevation import Elevation
from robot.nodes.point_clouds import pack_points, unpack_points
from robot.scenes.scene import Box, Obstacle
from robot.sim.depth_noise import look, seen
from robot.sim.devices import SimulatedDepth
from robot.sim.kinematic import KinematicBody
from tests.robot.stage import ORIGIN, floor

HEIGHT = 0.5
"""Of the body over the floor, m."""
CHEST = Box(1.6, 0.0, 0.3, 0.6, height=0.3)
"""Ahead of a robot at the origin that looks along x; lower than the LiDAR's plane."""

# -- depth_cameras ----------------------------------------------------------------------------------------------------------------


async def test_ten_pictures_a_second_come_fifty_milliseconds_after_they_were_taken(rig: Rig) -> None:
    body = KinematicBody(floor(CHEST), seed=1)
    await rig.start(Child(DepthCameras, args=(SimulatedDepth(body, 1),)))
    clouds = rig.probe(DEPTH_POINTS)
    await rig.advance(5.0)
    late = [at - seconds(cloud.header.stamp) for cloud, at in zip(clouds, clouds.times, strict=True)]
    assert late == pytest.approx([0.05] * len(late), abs=1e-6)
    assert 45 <= len(clouds) <= 50, "one in fifty is lost"
    assert len({cloud.width for cloud in clouds}) == 1
    assert {cloud.header.frame_id for cloud in clouds} == {"base_link"}


async def test_the_points_lie_on_the_floor_and_on_what_stands_there_but_for_noise_and_some_are_missing(
    rig: Rig,
) -> None:
    body = KinematicBody(floor(CHEST), seed=1)
    await rig.start(Child(DepthCameras, args=(SimulatedDepth(body, 1),)))
    clouds = rig.probe(DEPTH_POINTS)
    await rig.advance(1.0)
    z = float(body.truth().position[2])
    together = np.concatenate([unpack_points(cloud) for cloud in clouds])
    had = np.isfinite(together[:, 0])
    assert 0.4 < had.mean() < 0.96, "one in twenty, and what looks over the floor"
    points = together[had] + (0.0, 0.0, z)
    ahead = (np.abs(points[:, 1]) < 0.13 * points[:, 0]) & (points[:, 2] > 0.02) & (points[:, 2] < CHEST.height - 0.02)
    face = CHEST.x - CHEST.length / 2
    assert ahead.sum() > 50
    assert float(np.median(points[ahead, 0])) == pytest.approx(face, abs=0.01)
    assert np.abs(points[ahead, 0] - face).max() < 0.06
    beside = (np.abs(points[:, 1]) > 0.4) & (np.hypot(points[:, 0], points[:, 1]) < 2.0)
    assert abs(float(np.median(points[beside, 2]))) < 0.005
    assert np.abs(points[beside, 2]).max() < 0.08


async def test_nobody_renders_pictures_for_which_nobody_listens(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    body = KinematicBody(floor(CHEST), seed=1)
    asked: list[float] = []
    obstacles = body.obstacles

    def counted() -> tuple[Obstacle, ...]:
        asked.append(body.time)
        return obstacles()

    monkeypatch.setattr(body, "obstacles", counted)
    await rig.start(Child(DepthCameras, args=(SimulatedDepth(body, 1),)))
    await rig.advance(1.0)
    assert asked == []
    rig.probe(DEPTH_POINTS)
    await rig.advance(1.0)
    assert len(asked) == pytest.approx(10, abs=1)
    assert asked[-1] == pytest.approx(rig.now, abs=0.11), "pictures are of the present"


# -- elevation --------------------------------------------------------------------------------------------------------------------


class Told:
    """Publishes what the robot's other nodes tell of a robot that stands still, and the pictures that its cameras would take there."""

    def __init__(self, rig: Rig, *obstacles: Obstacle, here: Pose2 = ORIGIN, odometry_yaw: float = 0.0) -> None:
        self.rig, self.obstacles, self.here, self.odometry_yaw = rig, obstacles, here, odometry_yaw
        self.pattern = 0

    async def stands(self, mode: Mode = Mode.STAND) -> None:
        """Where it is, how it lies, and what it does: now."""
        stamp, turn = self.rig.me.clock.stamp(), self.odometry_yaw / 2
        lay = Pose(position=Point(z=HEIGHT), orientation=Quaternion(w=cos(turn), z=sin(turn)))
        self.rig.publish(GAIT_STATUS, GaitStatus(stamp=stamp, mode=mode, goal=mode))
        self.rig.publish(ODOMETRY, Odometry(header=Header(stamp=stamp), pose=PoseWithCovariance(pose=lay)))
        self.rig.publish(POSE, pose_stamped(self.here, stamp))
        await self.rig.advance(0.001)

    async def looks(self, pictures: int = 3) -> None:
        """Pictures, one in a tenth of a second."""
        for _ in range(pictures):
            await self.stands()
            place, yaw = np.array((self.here.x, self.here.y, HEIGHT)), self.here.yaw
            turned = np.array(((cos(yaw), -sin(yaw), 0.0), (sin(yaw), cos(yaw), 0.0), (0.0, 0.0, 1.0)))
            depths = look(self.obstacles, (), place, turned, self.pattern)
            depths[~np.isfinite(depths)] = np.nan
            header = Header(stamp=self.rig.me.clock.stamp(), frame_id="base_link")
            self.rig.publish(DEPTH_POINTS, pack_points(header, seen(depths, self.pattern)))
            self.pattern = (self.pattern + 1) % 8
            await self.rig.advance(0.1)

    async def scans(self, ranges: float) -> None:
        """One revolution that meets something so far away all round."""
        header = Header(stamp=self.rig.me.clock.stamp(), frame_id="lidar_link")
        self.rig.publish(SCAN, LaserScan(header=header, ranges=np.full(360, ranges)))
        await self.rig.advance(0.01)


def kind(relief: OccupancyGrid, x: float, y: float, half: float = 0.1) -> set[int]:
    """What the relief shows within a small square about (x, y)."""
    info = relief.info
    cells = relief.data.reshape(info.height, info.width)
    rows, columns = (
        slice(int((at - half - origin) / info.resolution), int((at + half - origin) / info.resolution))
        for at, origin in ((y, info.origin.position.y), (x, info.origin.position.x))
    )
    return set(cells[rows, columns].ravel().tolist())


async def test_what_stands_on_the_floor_is_a_wall_on_the_relief_and_what_is_behind_it_unseen(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    reliefs = rig.probe(RELIEF)
    await Told(rig, CHEST).looks(3)
    assert len(reliefs) == 3
    assert WALL in kind(reliefs.newest, 1.45, 0.0)
    assert kind(reliefs.newest, 1.0, 0.5) == {FREE}
    assert kind(reliefs.newest, 3.5, 3.5) == {UNSEEN}
    assert reliefs.newest.header.frame_id == "map"
    assert (reliefs.newest.info.width, reliefs.newest.info.height) == (160, 160)


async def test_the_localizer_says_where_it_looks_whatever_heading_odometry_has_drifted_to(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    reliefs = rig.probe(RELIEF)
    ahead = Box(2.0, 4.6, 0.6, 0.3, height=0.3)
    await Told(rig, ahead, here=Pose2(2.0, 3.0, pi / 2), odometry_yaw=-1.0).looks(3)
    assert WALL in kind(reliefs.newest, 2.0, 4.45)
    assert kind(reliefs.newest, 3.0, 3.0) == {FREE}


async def test_a_robot_that_lies_or_does_not_know_where_it_is_takes_in_nothing(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    reliefs = rig.probe(RELIEF)
    header = Header(stamp=rig.me.clock.stamp(), frame_id="base_link")
    somewhere = pack_points(header, np.full((len(eyes()), 3), 1.0))
    rig.publish(DEPTH_POINTS, somewhere)
    await rig.advance(0.1)
    assert len(reliefs) == 0, "no pose"
    told = Told(rig, CHEST)
    await told.stands(Mode.SIT)
    rig.publish(DEPTH_POINTS, somewhere.replace(header=Header(stamp=rig.me.clock.stamp())))
    await rig.advance(0.1)
    assert len(reliefs) == 0, "it sits"
    await told.looks(1)
    assert len(reliefs) == 1


async def test_a_robot_that_stands_up_after_a_while_knows_the_floor_under_it(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    reliefs = rig.probe(RELIEF)
    told = Told(rig, CHEST)
    await told.stands(Mode.SIT)
    await rig.advance(60.0)
    await told.looks(1)
    assert kind(reliefs.newest, 0.0, 0.0, half=0.3) == {FREE}


async def test_what_the_lidar_looks_through_is_gone(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    reliefs = rig.probe(RELIEF)
    person = Told(rig, Box(1.6, 0.0, 0.3, 0.3, height=1.7))
    await person.looks(3)
    assert UPRIGHT in kind(reliefs.newest, 1.45, 0.0)
    person.obstacles = ()
    await person.scans(4.0)
    await person.looks(1)
    assert not {UPRIGHT, WALL} & kind(reliefs.newest, 1.45, 0.0)


async def test_who_listens_is_told_height_doubt_and_age_of_each_cell(rig: Rig) -> None:
    await rig.start(Child(Elevation))
    told = Told(rig, CHEST)
    await told.looks(8)
    clouds = rig.probe(ELEVATION_POINTS)
    await rig.advance(0.6)
    assert len(clouds) == 1
    cloud = clouds.newest
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "doubt", "age"]
    cells = array_of_cloud(cloud)
    top = (np.abs(cells["x"] - 1.58) < 0.06) & (np.abs(cells["y"]) < 0.2)
    assert cells["z"][top] == pytest.approx(np.full(top.sum(), CHEST.height), abs=0.01)
    now = seconds(cloud.header.stamp)
    assert 0.0 < cells["age"].min() < 0.7
    assert cells["age"].max() <= now + 1e-3
    assert 0.0 < cells["doubt"][top].max() < 0.05
    first = cells["doubt"][top].mean()
    await rig.advance(5.0)
    later = array_of_cloud(clouds.newest)
    assert later["doubt"][top].mean() > first, "what is not looked at is doubted more and more"
    assert later["age"].min() > 5.0
