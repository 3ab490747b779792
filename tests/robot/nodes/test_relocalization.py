"""A robot that is somewhere else than it believes finds out, says so, stands still, and finds itself."""

from __future__ import annotations

from math import pi

import pytest

from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot import Robot
from robot.contracts import LOCALIZATION, POSE, RELOCALIZE
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose
from robot.geometry.planar import Pose2
from robot.hardware.sensors import Sensors


@pytest.mark.parametrize("sensors", [Sensors.ideal(), Sensors.real()], ids=["ideal", "real"])
@pytest.mark.parametrize(
    "there",
    [
        Pose2(2.5, -2.3, pi),
        pytest.param(Pose2(8.8, 3.4, 2.0), marks=pytest.mark.slow(reason="another place")),
        pytest.param(Pose2(4.75, 3.5, -0.7), marks=pytest.mark.slow(reason="another place")),
    ],
)
async def test_a_robot_that_is_put_elsewhere_finds_itself_within_ten_seconds(
    rig: Rig, sensors: Sensors, there: Pose2
) -> None:
    robot = Robot("warehouse", body="kinematic", sensors=sensors, seed=2)
    await rig.start(robot.tree)
    poses, states = rig.probe(POSE), rig.probe(LOCALIZATION)
    await rig.advance(2.0)
    robot.body.place(there)
    await rig.until(lambda: bool(states) and states.newest.data == "tracking", within=9.5)
    await rig.advance(0.5)
    here = from_pose(poses.newest.pose)
    assert (here.x, here.y) == pytest.approx((there.x, there.y), abs=0.03)
    assert wrap(here.yaw - there.yaw) == pytest.approx(0.0, abs=0.02)
    assert states.newest.data == "tracking"
    assert "lost" in [state.data for state in states]


@pytest.mark.slow(reason="a whole patrol")
async def test_a_robot_that_knows_where_it_is_says_nothing_of_it(rig: Rig) -> None:
    await rig.start(Robot("warehouse", body="kinematic", sensors=Sensors.real(), mission="patrol").tree)
    states = rig.probe(LOCALIZATION)
    await rig.advance(20.0)
    assert not len(states)


@pytest.mark.slow(reason="a long walk")
async def test_an_empty_world_is_no_reason_to_say_that_scans_do_not_fit(rig: Rig) -> None:
    """There is nothing on the map that a scan could fit or not."""
    await rig.start(Robot("empty", body="kinematic").tree)
    states = rig.probe(LOCALIZATION)
    await rig.advance(30.0)
    assert not len(states)
    assert not [line for _, line in rig.lines() if "scans" in line or "LiDAR" in line]


async def test_asked_to_look_it_answers_where_it_is(rig: Rig) -> None:
    robot = Robot("warehouse", body="kinematic", sensors=Sensors.real(), seed=2)
    await rig.start(robot.tree)
    await rig.advance(1.0)
    robot.body.place(Pose2(8.8, 3.4, 2.0))
    await rig.advance(0.4)
    answer = await rig.call(RELOCALIZE, Trigger.Request(), timeout=5.0)
    assert answer.success
    assert "8." in answer.message
    assert "3." in answer.message
