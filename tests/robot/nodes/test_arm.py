"""The robot's own arm: one state behind an action and a service (A-05, A-53 to A-57, N-37), a gripper, and stops."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import numpy as np
import pytest

from actors import (
    ActorError,
    Backoff,
    Child,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    GoalStatus,
    Node,
    every,
    publishes,
)
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.runtime.retry import retry
from actors.testing import Rig
from robot.contracts import (
    ARM_JOINT_STATES,
    CALIBRATE_GRIPPER,
    GET_CURRENT_POSITION,
    GRIPPER,
    GRIPPER_STATE,
    MOVE_ARM,
    SAFETY_STATE,
)
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import SafetyState
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition
from robot.model.arm import MOUNT, STOWED, Tip, forward, inverse
from robot.nodes.arm import ArmDriver
from robot.planning.trajectory import ARM_LIMITS
from robot.scenes.scene import Box, Cylinder, Scene, Thing
from robot.sim.devices import SimulatedArm
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.sim.things import centre

CUP = Thing("cup", Cylinder(0.9, 0.1, 0.035, 0.1), (200, 20, 20), z=0.2)
SCENE = Scene(
    "table", (-5.0, -5.0, 5.0, 5.0), (Box(0.95, 0.1, 0.3, 0.3, height=0.2),), Pose2(0.0, 0.0), Pose2(0.0, 0.0), things=(CUP,)
)  # fmt: skip
FORWARD = (0.5, -1.2, 1.6, 0.3)
HALF_WAY = [(a + b) / 2 for a, b in zip(STOWED, FORWARD, strict=True)]


def driver(body: Simulation) -> Child:
    return Child(ArmDriver, name="arm", args=(SimulatedArm(body),))


def goal(*angles: float) -> MoveArm.Goal:
    return MoveArm.Goal(target_angles=angles)


async def where(rig: Rig) -> tuple[list[float], str]:
    reply = await rig.call(GET_CURRENT_POSITION, GetPosition.Request())
    return reply.joint_angles.tolist(), reply.arm_status


def limits_kept(rig_joints: list[np.ndarray], hz: float) -> bool:
    """Speed and acceleration of what the joint topic showed."""
    table = np.array(rig_joints)
    speed = np.diff(table, axis=0) * hz
    acceleration = np.diff(speed, axis=0) * hz
    return bool(
        (np.abs(speed) <= ARM_LIMITS.speed + 1e-6).all()
        and (np.abs(acceleration) <= ARM_LIMITS.acceleration + 1e-6).all()
    )


async def test_the_position_service_tells_the_true_angles_before_during_and_after_a_motion(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    assert await where(rig) == (list(STOWED), "IDLE")
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.5)
    angles, status = await where(rig)
    assert status == "MOVING"
    assert angles != list(STOWED)
    assert angles != list(FORWARD)
    await rig.until(lambda: moving.done)
    assert await where(rig) == (list(FORWARD), "IDLE")


async def test_half_way_the_service_tells_half_the_way_and_the_action_agrees(rig: Rig) -> None:
    body = KinematicBody(SCENE, seed=1, arm=True)
    await rig.start(driver(body))
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.1)
    await rig.until(lambda: body.arm is not None and body.arm.state().progress >= 0.5)
    angles, status = await where(rig)
    assert status == "MOVING"
    assert angles == pytest.approx(HALF_WAY, abs=0.03)
    result = await moving
    assert result.success
    assert result.message == "Movement completed successfully"
    assert result.final_angles.tolist() == list(FORWARD)


async def test_feedback_comes_ten_times_a_second_never_falls_and_earlier_ones_keep_their_numbers(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    joints = rig.probe(ARM_JOINT_STATES)
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    begun, seen, copies = rig.now, [], []
    async for feedback in moving:
        seen.append(feedback)
        copies.append(feedback.current_angles.copy())
    assert len(seen) == int((rig.now - begun - 0.01) * 10.0) + 2
    assert [one.progress_percentage for one in (seen[0], seen[-1])] == [0.0, 100.0]
    assert all(a.progress_percentage <= b.progress_percentage for a, b in pairwise(seen))
    assert all((one.current_angles == copy).all() for one, copy in zip(seen, copies, strict=True))
    assert seen[3].status == f"Moving... {seen[3].progress_percentage:.1f}% complete"
    assert joints.last is not None
    assert joints.last.name == ("arm_yaw", "arm_shoulder", "arm_elbow", "arm_wrist")
    assert limits_kept([message.position for message in joints], 50.0)
    assert [round(b - a, 6) for a, b in pairwise(joints.times)] == [0.02] * (len(joints) - 1)


async def test_a_cancelled_motion_brakes_within_limits_and_tells_where_it_really_stopped(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    joints = rig.probe(ARM_JOINT_STATES)
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.7)
    asked = rig.now
    assert await moving.cancel()
    with pytest.raises(GoalCanceled) as canceled:
        await moving
    result = canceled.value.result
    assert (result.success, result.message) == (False, "Movement canceled")
    assert rig.now - asked < 0.6, "the time it takes to brake within limits"
    angles, status = await where(rig)
    assert (angles, status) == (result.final_angles.tolist(), "IDLE")
    assert angles != list(FORWARD)
    count = moving.feedback_count
    await rig.advance(1.0)
    assert await where(rig) == (angles, "IDLE")
    assert moving.feedback_count == count
    assert limits_kept([message.position for message in joints], 50.0)
    again = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    assert (await again).final_angles.tolist() == list(FORWARD)


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ([0.0] * 3, "4 joints"),
        ([0.0] * 5, "4 joints"),
        ([0.0, float("nan"), 0.0, 0.0], "arm_shoulder would be at nan"),
        ([0.0, -1.0, 1.0, 2.5], "arm_wrist would be at 2.500 rad, outside -1.833 to 1.833"),
    ],
)
async def test_what_the_arm_cannot_take_is_refused_with_the_reason_and_nothing_moves(
    rig: Rig, angles: list[float], words: str
) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    with pytest.raises(GoalRejected, match=words):
        await rig.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=angles))
    await rig.advance(0.5)
    assert await where(rig) == (list(STOWED), "IDLE")


async def test_a_newer_goal_preempts_and_begins_where_the_first_one_stopped(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    joints = rig.probe(ARM_JOINT_STATES)
    first = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.6)
    second = await rig.send_goal(MOVE_ARM, goal(-1.0, -1.0, 1.0, 0.0))
    opening = await anext(aiter(second))
    with pytest.raises(GoalCanceled) as preempted:
        await first
    assert opening.current_angles.tolist() == preempted.value.result.final_angles.tolist()
    assert opening.progress_percentage == 0.0
    assert (await second).final_angles.tolist() == [-1.0, -1.0, 1.0, 0.0]
    third = await rig.send_goal(MOVE_ARM, goal(*STOWED))
    assert (await anext(aiter(third))).current_angles.tolist() == [-1.0, -1.0, 1.0, 0.0]
    await third
    assert limits_kept([message.position for message in joints], 50.0)


async def test_a_stop_of_the_robot_brakes_the_arm_and_until_it_is_cleared_nothing_moves(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.6)
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt",)))
    with pytest.raises(GoalAborted, match="tilt") as aborted:
        await moving
    assert aborted.value.result.message == "Movement stopped: tilt"
    with pytest.raises(GoalRejected, match="stopped: tilt"):
        await rig.send_goal(MOVE_ARM, goal(*STOWED))
    rig.publish(SAFETY_STATE, SafetyState(stopped=False))
    await rig.advance(0.1)
    await rig.send_goal(MOVE_ARM, goal(*STOWED))
    await rig.advance(1.0)  # and the monitor says no more: who obeys it stops
    with pytest.raises(GoalRejected, match="silent"):
        await rig.send_goal(MOVE_ARM, goal(*STOWED))


class Monitor(Node):
    """A safety monitor that stops the robot when its test says so."""

    state = publishes(SAFETY_STATE)
    stopped = False

    @every(hz=20)
    def tell(self) -> None:
        self.state(SafetyState(stopped=self.stopped, reasons=("tilt",) if self.stopped else ()))


async def test_a_motion_that_is_aborted_twice_is_sent_again_and_succeeds_the_third_time(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)), Monitor)
    failures: list[ActorError] = []
    work = asyncio.ensure_future(
        retry(rig.me, MOVE_ARM, goal(*FORWARD), attempts=3, backoff=Backoff(1.0, 5.0), on_failure=failures.append)
    )
    for failed in (1, 2):
        await rig.advance(0.1)
        assert (await where(rig))[1] == "MOVING"
        rig.node(Monitor).stopped = True
        await rig.until(lambda failed=failed: len(failures) == failed)  # type: ignore[misc]
        rig.node(Monitor).stopped = False
        await rig.advance(1.0 if failed == 1 else 2.0)
        await rig.advance(0.3)
    assert (await work).final_angles.tolist() == list(FORWARD)
    assert [type(error) for error in failures] == [GoalAborted, GoalAborted]


async def test_an_arm_whose_node_fails_stops_and_the_next_life_knows_where_it_is(rig: Rig) -> None:
    await rig.start(driver(KinematicBody(SCENE, seed=1, arm=True)))
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    await rig.advance(0.6)
    rig.crash("arm")
    with pytest.raises(GoalAborted):
        await moving
    await rig.advance(1.0)
    angles, status = await where(rig)
    assert status == "IDLE"
    assert angles != list(FORWARD)
    assert rig.incarnation("arm") == 2


async def test_the_gripper_is_calibrated_and_grips_only_what_is_between_its_jaws(rig: Rig) -> None:
    body = KinematicBody(SCENE, seed=1, arm=True)
    await rig.start(driver(body))
    told = rig.probe(GRIPPER_STATE)
    reply = await rig.call(CALIBRATE_GRIPPER, Trigger.Request())
    assert (reply.success, reply.message) == (True, "Gripper calibrated: 0 to 120 mm")
    reply = await rig.call(GRIPPER, SetBool.Request(data=True))
    assert (reply.success, reply.message) == (False, "Gripper closed on nothing")
    await rig.call(GRIPPER, SetBool.Request(data=False))
    assert body.arm is not None
    dx, dy, dz = centre(CUP) - body.truth().position - np.array(MOUNT)
    for off, held in ((0.025, None), (0.015, "cup")):
        await (await rig.send_goal(MOVE_ARM, goal(*inverse(Tip(dx, dy, dz + off, 0.6)))))
        reply = await rig.call(GRIPPER, SetBool.Request(data=True))
        assert reply.success is (held is not None)
        assert body.arm.held == held
        if held is None:
            await rig.call(GRIPPER, SetBool.Request(data=False))
    assert reply.message == "Gripping something: 70 mm"
    assert told.last is not None
    assert told.last.gripping
    assert told.last.opening == pytest.approx(0.07)
    assert not (await rig.call(CALIBRATE_GRIPPER, Trigger.Request())).success
    await (await rig.send_goal(MOVE_ARM, goal(*inverse(Tip(dx, dy, dz + 0.1, 0.6)))))
    assert body.things()[0].z == pytest.approx(CUP.z + 0.085)
    await rig.call(GRIPPER, SetBool.Request(data=False))
    assert body.things()[0].z == CUP.z
    assert body.arm.held is None


async def test_the_arm_in_physics_ends_within_a_milliradian_and_its_feedback_does_not_fall(rig: Rig) -> None:
    body = PhysicsBody(SCENE, seed=1, arm=True)
    await rig.start(driver(body))
    moving = await rig.send_goal(MOVE_ARM, goal(*FORWARD))
    seen = [feedback async for feedback in moving]
    result = await moving
    assert moving.status is GoalStatus.SUCCEEDED
    assert np.abs(result.final_angles - FORWARD).max() < 1e-3
    assert all(a.progress_percentage <= b.progress_percentage for a, b in pairwise(seen))
    assert forward(result.final_angles.tolist())[:3] == pytest.approx(forward(FORWARD)[:3], abs=2e-3)


def test_a_body_without_an_arm_has_none_to_drive() -> None:
    with pytest.raises(ValueError, match="has no arm"):
        SimulatedArm(KinematicBody(SCENE, seed=1))
