"""Scans that fit several places: the localizer weighs these, and neither an odometry that starts over nor a wrong word about the place ends that."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from actors import Child
from actors.interfaces.geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot.contracts import INITIAL_POSE, LOCALIZATION, ODOMETRY, POSE, RELOCALIZE, SCAN
from robot.geometry.messages import from_pose, to_pose
from robot.geometry.planar import Pose2, compose
from robot.nodes.localizer import Localizer
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Scene
from robot.sim.lidar_rays import cast

WALLS = (
    *(Box(0.0, y, 12.2, 0.1, height=2.0) for y in (-2.05, 2.05)),
    *(Box(x, 0.0, 0.1, 4.2, height=2.0) for x in (-6.05, 6.05)),
)
ORIGIN = Pose2(0.0, 0.0)
PILLAR = Box(5.8, 1.8, 0.4, 0.4, height=2.0)
HALL = Scene("hall", (-6.0, -2.0, 6.0, 2.0), (*WALLS, PILLAR), ORIGIN, ORIGIN)
"""The same by half a turn, but for a little pillar."""
HERE, MIRRORED = Pose2(-3.0, 0.5, 0.1), Pose2(3.0, -0.5, 0.1 - pi)
ELSEWHERE = Pose2(-1.5, 0.0, 1.5)
"""Where the robot believes to be at first: no scan of the hall fits there."""


class Walk:
    """A robot that stands or walks in a hall; `odom` is where its odometry began."""

    def __init__(self, rig: Rig, scene: Scene, here: Pose2) -> None:
        self._rig, self._scene, self.here, self.odom = rig, scene, here, ORIGIN

    async def on(self, seconds: float, speed: float = 0.0) -> None:
        """Odometry at 50 Hz and scans at 10 Hz."""
        for tick in range(round(50 * seconds)):
            step = Pose2(0.02 * speed, 0.0)
            self.here, self.odom = compose(self.here, step), compose(self.odom, step)
            header = Header(stamp=self._rig.me.clock.stamp(), frame_id="odom")
            self._rig.publish(ODOMETRY, Odometry(header=header, pose=PoseWithCovariance(pose=to_pose(self.odom))))
            if tick % 5 == 0:
                ranges = cast(self._scene, self.here.x, self.here.y, self.here.yaw)
                self._rig.publish(SCAN, LaserScan(header=header.replace(frame_id="lidar_link"), ranges=ranges))
            await self._rig.advance(0.02)


def told(pose: Pose2) -> PoseWithCovarianceStamped:
    return PoseWithCovarianceStamped(header=Header(frame_id="map"), pose=PoseWithCovariance(pose=to_pose(pose)))


async def walk(rig: Rig, scene: Scene, start: Pose2 = ELSEWHERE) -> Walk:
    await rig.start(Child(Localizer, args=(Grid.from_scene(scene), start)))
    return Walk(rig, scene, HERE)


async def test_walking_up_to_the_pillar_tells_which_half_it_is(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await walked.on(5.0)
    assert states.newest.data == "ambiguous"
    answer = await rig.call(RELOCALIZE, Trigger.Request(), timeout=5.0)
    assert (answer.success, answer.message) == (False, "the scan fits 2 places alike")
    await walked.on(8.0, speed=0.9)
    here = from_pose(poses.newest.pose)
    assert states.newest.data == "tracking"
    assert (here.x, here.y) == pytest.approx((walked.here.x, walked.here.y), abs=0.05)


@pytest.mark.slow(reason="a long search")
async def test_places_that_are_alike_are_carried_over_when_odometry_begins_anew(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await walked.on(5.0)
    assert states.newest.data == "ambiguous"
    walked.odom = Pose2(40.0, -7.0, 2.0)
    so_far = len(states)
    await walked.on(2.0)
    assert [state.data for state in states][so_far:] == []  # both places still fit
    await walked.on(8.0, speed=0.9)
    here = from_pose(poses.newest.pose)
    assert (here.x, here.y) == pytest.approx((walked.here.x, walked.here.y), abs=0.05)


async def test_a_search_under_way_when_odometry_begins_anew_finds_the_robot_where_it_is(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await walked.on(0.2)
    rig.publish(INITIAL_POSE, told(HERE))
    await walked.on(0.1)
    walked.odom = Pose2(40.0, -7.0, 2.0)
    await walked.on(2.0)
    here = from_pose(poses.newest.pose)
    assert (here.x, here.y) == pytest.approx((HERE.x, HERE.y), abs=0.05)
    assert not [state for state in states if state.data == "lost"]


@pytest.mark.slow(reason="a long search")
async def test_wrong_words_about_the_place_do_not_end_the_search_for_it(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await walked.on(5.0)
    assert states.newest.data == "ambiguous"
    for _ in range(6):
        rig.publish(INITIAL_POSE, told(ELSEWHERE))
        await walked.on(0.5)
    await walked.on(8.0, speed=0.9)
    await walked.on(3.0)
    here = from_pose(poses.newest.pose)
    assert states.newest.data == "tracking"
    assert (here.x, here.y) == pytest.approx((walked.here.x, walked.here.y), abs=0.05)


async def test_a_localizer_that_failed_while_it_was_in_doubt_says_when_it_no_longer_is(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    states = rig.probe(LOCALIZATION)
    await walked.on(5.0)
    assert states.newest.data == "ambiguous"
    rig.crash("localizer")
    rig.publish(INITIAL_POSE, told(HERE))
    await walked.on(2.0)
    assert states.newest.data == "tracking"


async def test_a_localizer_that_failed_while_it_was_in_doubt_is_in_doubt_until_it_has_looked(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await walked.on(5.0)
    so_far = len(states)
    rig.crash("localizer")
    await walked.on(3.0)
    assert [state.data for state in states][so_far:] == []
    await walked.on(8.0, speed=0.9)
    here = from_pose(poses.newest.pose)
    assert states.newest.data == "tracking"
    assert (here.x, here.y) == pytest.approx((walked.here.x, walked.here.y), abs=0.05)


async def test_a_word_about_the_place_before_the_first_scan_is_heeded_with_the_first_scan(rig: Rig) -> None:
    walked = await walk(rig, HALL)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = 0.5**2
    about = PoseWithCovariance(pose=to_pose(Pose2(HERE.x + 1.0, HERE.y - 0.5, HERE.yaw + 0.6)), covariance=covariance)
    rig.publish(INITIAL_POSE, PoseWithCovarianceStamped(header=Header(frame_id="map"), pose=about))
    await rig.advance(1.0)
    await walked.on(0.8)
    here = from_pose(poses.newest.pose)
    assert (here.x, here.y) == pytest.approx((HERE.x, HERE.y), abs=0.05)
    assert [state.data for state in states] == []
