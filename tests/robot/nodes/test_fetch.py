"""Fetch a cup, and carry it (X-03, Y-10): the robot's whole tree, camera and localizer included, in a kitchen.

These take some seconds each: the story of one fetch lasts 20 to 30 simulated seconds of the whole robot at 200 Hz.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from actors import GoalAborted, GoalCanceled, GoalRejected
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.testing import Rig
from actors.typing import Goal
from robot.contracts import (
    ARM_JOINT_STATES,
    CALIBRATE_GRIPPER,
    CAMERA_RGB,
    CMD_VEL,
    FETCH_AND_CARRY,
    GET_ROBOT_POSE,
    GRIPPER_STATE,
    IMU,
    JOINT_STATES,
    NAVIGATE_AND_GRAB,
    POSE,
)
from robot.interfaces.robactor_msgs.action import FetchAndCarry
from robot.interfaces.tutorials.proposed_interfaces.action import (
    NavigateAndGrab,
    NavigateAndGrab_Feedback,
    NavigateAndGrab_Result,
)
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose
from robot.model.arm import STOWED
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.sim.things import centre
from tests.robot.stage import CUP, KITCHEN, OTHER_TABLE, at, awake, upon

STAGES = ["calibrate", "confirm", "navigate", "grab"]


def robot(seed: int = 1) -> KinematicBody:
    return KinematicBody(KITCHEN, seed=seed, arm=True)


def held(body: Simulation) -> str | None:
    assert body.arm is not None
    return body.arm.held


def monotone(told: list[NavigateAndGrab_Feedback]) -> bool:
    """Stages in their order, distances that never grow, per cent that never fall."""
    order = [STAGES.index(one.stage) for one in told]
    return (
        order == sorted(order)
        and all(a.distance_remaining >= b.distance_remaining for a, b in pairwise(told))
        and all(a.progress_percent <= b.progress_percent for a, b in pairwise(told))
    )


async def send(
    rig: Rig, name: str = "cup", where: PoseStamped | None = None
) -> Goal[NavigateAndGrab_Result, NavigateAndGrab_Feedback]:
    where = at(2.0, 1.0) if where is None else where
    return await rig.send_goal(NAVIGATE_AND_GRAB, NavigateAndGrab.Goal(object_name=name, target_pose=where))


@pytest.mark.slow(reason="the first half of the test of the whole task, with more looked at")
async def test_the_cup_is_confirmed_walked_to_grabbed_and_held(rig: Rig) -> None:
    body = await awake(rig, robot())
    poses, images = rig.probe(POSE), rig.probe(CAMERA_RGB)
    streams = [rig.probe(ARM_JOINT_STATES), rig.probe(JOINT_STATES), rig.probe(IMU)]
    goal = await send(rig)
    told: list[NavigateAndGrab_Feedback] = []
    async for feedback in goal:
        told.append(feedback)
        if len(told) % 20 == 0:  # whoever asks while it is busy is answered
            reply = await rig.call(GET_ROBOT_POSE, GetRobotPose.Request())
            position = body.truth().position
            assert reply.success
            assert (reply.pose.pose.position.x, reply.pose.pose.position.y) == pytest.approx(
                position[:2].tolist(), abs=0.1
            )
        if len(told) == 5:
            images.clear()
    result = await goal
    assert (result.success, result.held_object, result.message) == (True, "cup", "cup grabbed")
    assert held(body) == "cup"
    assert list(dict.fromkeys(feedback.stage for feedback in told)) == STAGES
    assert monotone(told)
    assert (told[0].progress_percent, told[-1].progress_percent) == (0.0, 100.0)
    assert max(b - a for a, b in pairwise(poses.times)) < 0.05, "the pose kept coming all the time"
    assert len(images) > 100
    assert all(len(stream) > 400 for stream in streams)
    assert body.truth().touching == ()
    assert body.not_achievable is None
    assert body.arm is not None
    assert body.arm.state().position.tolist() == list(STOWED)
    assert body.things()[0].z > CUP.z


async def test_an_object_that_is_not_confirmed_moves_nothing(rig: Rig) -> None:
    body = await awake(rig, robot())
    before, joints, commands = body.truth().position, rig.probe(ARM_JOINT_STATES), rig.probe(CMD_VEL)
    with pytest.raises(GoalAborted, match="confirm: box is not in sight") as aborted:
        await (await send(rig, "box", at(-2.0, 2.5)))
    assert aborted.value.result.message == "confirm: box is not in sight"
    assert aborted.value.result.held_object == ""
    await rig.advance(1.0)
    assert body.truth().position.tolist() == before.tolist()
    assert {tuple(message.position.tolist()) for message in joints} == {STOWED}
    assert all(message.linear.x == 0.0 and message.angular.z == 0.0 for message in commands)


async def test_an_object_that_is_not_where_it_was_said_to_be_moves_nothing(rig: Rig) -> None:
    body = await awake(rig, robot())
    with pytest.raises(GoalAborted, match=r"confirm: cup was seen 2\.\d m from where it was expected"):
        await (await send(rig, "cup", at(3.5, -1.0)))
    assert np.hypot(*body.truth().position[:2]) < 0.01


@pytest.mark.parametrize(
    ("name", "frame", "words"),
    [("mug", "map", "no object called 'mug'; known are: cup, box"), ("cup", "odom", "unknown frame 'odom'")],
)
async def test_what_cannot_be_asked_is_refused_with_the_reason(rig: Rig, name: str, frame: str, words: str) -> None:
    await awake(rig, robot())
    where = at(2.0, 1.0)
    with pytest.raises(GoalRejected, match=words):
        await send(rig, name, where.replace(header=where.header.replace(frame_id=frame)))


async def test_a_cancel_half_way_stops_the_robot_with_an_empty_gripper(rig: Rig) -> None:
    body = await awake(rig, robot())
    gripper = rig.probe(GRIPPER_STATE)
    goal = await send(rig)
    told: list[NavigateAndGrab_Feedback] = []
    async for feedback in goal:
        told.append(feedback)
        if feedback.progress_percent >= 40.0:
            break
    assert told[-1].stage == "navigate"
    with pytest.raises(GoalRejected, match="busy with navigate_and_grab"):
        await send(rig)
    assert await goal.cancel()
    asked = rig.now
    with pytest.raises(GoalCanceled) as canceled:
        await goal
    assert rig.now - asked < 1.0
    assert (canceled.value.result.success, canceled.value.result.message) == (False, "Task canceled")
    await rig.advance(1.5)
    stopped = body.truth().position
    await rig.advance(1.0)
    assert np.abs(body.truth().position - stopped)[:2].max() < 0.01
    assert held(body) is None
    assert gripper.last is not None
    assert not gripper.last.gripping
    assert body.things()[0] == CUP
    assert (await rig.call(CALIBRATE_GRIPPER, CALIBRATE_GRIPPER.request())).success


@pytest.mark.slow(reason="a walk with an arm")
async def test_a_cup_that_is_snatched_from_the_jaws_is_looked_for_and_reached_for_again(rig: Rig) -> None:
    body = robot()
    await awake(rig, body)
    gripper = rig.probe(GRIPPER_STATE)
    goal = await send(rig)
    async for feedback in goal:
        if feedback.stage == "grab":
            break
    await rig.until(lambda: gripper.last is not None and gripper.last.closing)
    assert body._arm is not None
    body._arm._things.put(0, centre(CUP) + np.array([0.05, 0.04, 0.0]))
    result = await goal
    assert (result.success, held(body)) == (True, "cup")
    assert [record.fields["why"] for record in rig.logs if record.event == "standing elsewhere"] == [
        "the gripper closed on nothing where cup was seen"
    ]


async def test_the_cup_is_carried_to_the_second_table_and_released_there(rig: Rig) -> None:
    body = await awake(rig, robot())
    goal = await rig.send_goal(
        FETCH_AND_CARRY,
        FetchAndCarry.Goal(object_name="cup", target_pose=at(2.0, 1.0), place_pose=upon(OTHER_TABLE)),
    )
    told = [feedback async for feedback in goal]
    result = await goal
    assert (result.success, result.held_object) == (True, "")
    assert list(dict.fromkeys(feedback.stage for feedback in told)) == [*STAGES, "carry", "release"]
    assert all(a.distance_remaining >= b.distance_remaining for a, b in pairwise(told))
    assert all(a.progress_percent <= b.progress_percent for a, b in pairwise(told))
    assert held(body) is None
    cup = body.things()[0]
    assert cup.z == pytest.approx(OTHER_TABLE.z)
    assert np.hypot(cup.shape.x - OTHER_TABLE.x, cup.shape.y - OTHER_TABLE.y) < 0.05
    assert body.truth().touching == ()


@pytest.mark.slow(reason="a task of minutes in physics")
async def test_in_physics_the_cup_is_fetched_carried_and_stands_on_the_second_table(rig: Rig) -> None:
    body = await awake(rig, PhysicsBody(KITCHEN, seed=1, arm=True))
    goal = await rig.send_goal(
        FETCH_AND_CARRY,
        FetchAndCarry.Goal(object_name="cup", target_pose=at(2.0, 1.0), place_pose=upon(OTHER_TABLE)),
    )
    async for feedback in goal:
        if feedback.stage == "carry":
            assert held(body) == "cup"
    assert (await goal).success
    await rig.advance(1.0)
    x, y, z = centre(body.things()[0])
    assert np.hypot(x - OTHER_TABLE.x, y - OTHER_TABLE.y) < 0.05
    assert z == pytest.approx(OTHER_TABLE.z + 0.05, abs=2e-3)
    truth = body.truth()
    assert not truth.fallen
    assert truth.touching == ()
