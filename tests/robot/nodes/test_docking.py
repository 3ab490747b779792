"""Onto the charging station by sight and off it again, and every way in which that can fail (kinematic body, virtual time)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from actors import GoalAborted, GoalCanceled, GoalRejected
from actors.interfaces.nav_msgs.msg import Path
from actors.testing import Rig
from robot.contracts import AUTONOMY_CMD, DOCK, DOCK_STATUS, GAIT_STATUS, NAVIGATE_TO_GOAL, PATH, UNDOCK
from robot.estimation.dock_finder import find_dock
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, compose
from robot.interfaces.robactor_msgs.action import Dock
from robot.scenes.dock import station
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody
from robot.sim.lidar_rays import cast
from tests.robot.stage import Legs, apart, navigate, speed, standing_robot, take_station_away, true_pose


def off_dock(body: KinematicBody) -> tuple[float, float]:
    """How far the true body is from its dock, m and rad."""
    here, dock = true_pose(body), body.scene.dock
    return apart(here, dock), abs(wrap(here.yaw - dock.yaw))


async def mode_after_a_second(rig: Rig) -> str:
    status = rig.probe(GAIT_STATUS)
    await rig.advance(1.0)
    assert status.last is not None
    return status.last.mode


async def test_the_robot_docks_within_centimeters_charges_and_leaves_again(rig: Rig) -> None:
    body = await standing_robot(rig)
    states = rig.probe(DOCK_STATUS)
    going = await rig.send_goal(DOCK, Dock.Goal())
    stages = list(dict.fromkeys([feedback.stage async for feedback in going]))
    result = await going
    assert (result.success, result.outcome) == (True, "docked")
    assert stages == ["going", "looking", "approaching", "sitting"]
    away, turned = off_dock(body)
    assert away < 0.05
    assert turned < 0.06
    again = await (await rig.send_goal(DOCK, Dock.Goal()))
    assert again.message == "already docked and charging"
    left = await (await rig.send_goal(UNDOCK, Dock.Goal()))
    assert (left.success, left.outcome) == (True, "undocked")
    assert off_dock(body)[0] == pytest.approx(0.8, abs=0.1)
    assert await mode_after_a_second(rig) == "stand"
    assert [state.state for state in states] == ["UNDOCKED", "DOCKING", "DOCKED", "UNDOCKED"]
    assert rig.node(Legs).touched == set()


async def test_a_dock_that_is_away_is_not_found(rig: Rig) -> None:
    body = await standing_robot(rig)
    take_station_away(body)
    going = await rig.send_goal(DOCK, Dock.Goal())
    with pytest.raises(
        GoalAborted, match="dock not found: no station seen within 3 s where the map has the dock"
    ) as failed:
        await going
    assert failed.value.result.outcome == "dock not found"


async def test_a_dock_that_vanishes_during_the_approach_is_lost_and_the_robot_stops(rig: Rig) -> None:
    body = await standing_robot(rig)
    going = await rig.send_goal(DOCK, Dock.Goal())
    async for feedback in going:
        if feedback.stage == "approaching" and feedback.distance_remaining < 0.6:
            break
    take_station_away(body)
    with pytest.raises(GoalAborted, match="dock lost: the station has been out of sight for 1 s"):
        await going
    assert await mode_after_a_second(rig) == "stand"
    assert speed(body) < 0.02


async def test_contacts_that_do_not_close_are_tried_again_and_then_called_misaligned(rig: Rig) -> None:
    await standing_robot(rig)
    rig.node(Legs).charger_works = False
    going = await rig.send_goal(DOCK, Dock.Goal())
    stages = [feedback.stage async for feedback in going]
    with pytest.raises(GoalAborted, match="misaligned: the charger's contacts did not close in 3 approaches"):
        await going
    assert stages.count("sitting") == 3


async def test_docking_that_takes_too_long_times_out(rig: Rig) -> None:
    await standing_robot(rig)
    begun = rig.now
    going = await rig.send_goal(DOCK, Dock.Goal(timeout=3.0))
    with pytest.raises(GoalAborted, match="timed out: not finished within 3 s"):
        await going
    assert rig.now - begun < 3.3


async def test_docking_can_be_canceled_on_its_way_and_the_robot_stops(rig: Rig) -> None:
    body = await standing_robot(rig)
    going = await rig.send_goal(DOCK, Dock.Goal())
    async for feedback in going:
        if feedback.stage == "approaching":
            break
    commands = rig.probe(AUTONOMY_CMD)
    assert await going.cancel()
    with pytest.raises(GoalCanceled):
        await going
    assert await mode_after_a_second(rig) == "stand", "it does not step in place for ever"
    assert commands[-1].linear.x == 0.0
    assert speed(body) < 0.02


async def test_a_navigation_goal_during_the_approach_takes_the_robot_away(rig: Rig) -> None:
    await standing_robot(rig)
    docking = await rig.send_goal(DOCK, Dock.Goal())
    async for feedback in docking:
        if feedback.stage == "approaching":
            break
    going = await rig.send_goal(NAVIGATE_TO_GOAL, navigate(0.0, 0.0))
    with pytest.raises(GoalAborted, match="preempted: another goal took the robot away"):
        await docking
    assert (await going).success


async def test_a_path_without_poses_is_nobodys_walk_and_takes_nothing_away(rig: Rig) -> None:
    await standing_robot(rig)
    docking = await rig.send_goal(DOCK, Dock.Goal())
    async for feedback in docking:
        if feedback.stage == "approaching":
            rig.publish(PATH, Path())
    assert (await docking).success


async def test_a_second_docking_and_a_timeout_that_is_no_number_are_refused(rig: Rig) -> None:
    await standing_robot(rig)
    with pytest.raises(GoalRejected, match="the timeout nan is not a number of seconds"):
        await rig.send_goal(DOCK, Dock.Goal(timeout=math.nan))
    first = await rig.send_goal(DOCK, Dock.Goal())
    await rig.advance(0.5)
    with pytest.raises(GoalRejected):
        await rig.send_goal(UNDOCK, Dock.Goal())
    assert await first.cancel()


# -- the finder -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("world", ["warehouse", "corridor", "pillars"])
def test_the_station_is_found_from_wherever_an_approach_leads(world: str) -> None:
    scene, rng = get_world(world), np.random.default_rng(4)
    errors: list[float] = []
    for _ in range(60):
        true = compose(scene.dock, Pose2(-rng.uniform(0.0, 1.0), rng.normal(0.0, 0.05), rng.normal(0.0, 0.05)))
        believed = Pose2(
            true.x + rng.normal(0.0, 0.02), true.y + rng.normal(0.0, 0.02), true.yaw + rng.normal(0.0, 0.02)
        )
        ranges = cast(scene, true.x, true.y, true.yaw)
        found = find_dock(
            np.where(ranges < 10.0, ranges + rng.normal(0.0, 0.015, len(ranges)), 10.0), believed, scene.dock
        )
        assert found is not None
        seen = compose(scene.dock, found)
        errors.append(math.hypot(seen.x - true.x, seen.y - true.y))
    assert np.median(errors) < 0.05


def test_without_a_station_there_is_nothing_to_find() -> None:
    scene = get_world("warehouse")
    before = compose(scene.dock, Pose2(-0.8, 0.0, 0.0))
    bare = type(scene)(
        scene.name, scene.bounds, tuple(o for o in scene.obstacles if o != station(scene.dock)), scene.start, scene.dock
    )
    assert find_dock(cast(bare, before.x, before.y, before.yaw), before, scene.dock) is None
    assert find_dock(cast(scene, before.x, before.y, before.yaw), before, scene.dock) is not None


def test_a_half_hidden_station_is_no_station() -> None:
    scene = get_world("warehouse")
    before = compose(scene.dock, Pose2(-0.8, 0.0, 0.0))
    ranges = cast(scene, before.x, before.y, before.yaw)
    ranges[180:200] = 0.5
    assert find_dock(ranges, before, scene.dock) is None
