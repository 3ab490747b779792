"""The tutorial's robot arm (Y-29): its three nodes N-37 to N-39, the rows A-50 to A-57, and the whole of it, X-06."""

from __future__ import annotations

from typing import TypeAlias

import pytest

from actors import Child, GoalCanceled, GoalRejected
from actors.testing import Rig
from actors.typing import Goal
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm, MoveArm_Feedback, MoveArm_Result
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition
from robot.tutorials.robot_arm import (
    GET_CURRENT_POSITION,
    MOVE_ARM,
    ArmControlClient,
    MoveArmServer,
    PositionService,
    tree,
)
from tests.robot.stage import said
from tests.robot.tutorials.kit import alone

Moving: TypeAlias = Goal[MoveArm_Result, MoveArm_Feedback]
TARGET = [1.57, 0.78, -0.78, 0.0]
ZEROS = [0.0] * 4


async def start(rig: Rig, target: list[float]) -> Moving:
    return await rig.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=target))


async def where(rig: Rig) -> tuple[list[float], str]:
    reply = await rig.call(GET_CURRENT_POSITION, GetPosition.Request(), timeout=0.1)
    return reply.joint_angles.tolist(), reply.arm_status


async def test_the_position_service_alone_tells_zeros_and_idle(rig: Rig) -> None:
    await rig.start(PositionService)
    assert await where(rig) == (ZEROS, "IDLE")
    assert said(rig, "position_service") == ["Returning current position: [0.0, 0.0, 0.0, 0.0]"]


async def test_fifty_feedbacks_in_five_seconds_and_the_exact_target(rig: Rig) -> None:
    await rig.start(MoveArmServer)
    moving = await start(rig, TARGET)
    times, told = [], []
    async for feedback in moving:
        times.append(rig.now)
        told.append(feedback)
    result = await moving
    assert times == pytest.approx([0.1 * i for i in range(50)])
    assert rig.now == pytest.approx(5.0)
    assert (told[0].progress_percentage, told[-1].progress_percentage) == (0.0, 100.0)
    assert told[0].status == "Moving... 0.0% complete"
    assert told[24].status == "Moving... 49.0% complete"
    assert told[24].progress_percentage == pytest.approx(48.98, abs=5e-3)
    assert (result.success, result.message) == (True, "Movement completed successfully")
    assert result.final_angles.tolist() == TARGET


async def test_steps_lie_on_a_straight_line(rig: Rig) -> None:
    await rig.start(MoveArmServer)
    moving = await start(rig, TARGET)
    for i, feedback in enumerate([feedback async for feedback in moving]):
        assert feedback.current_angles == pytest.approx([angle * i / 49 for angle in TARGET])


async def test_a_single_step_does_not_divide_by_zero(rig: Rig) -> None:
    await rig.start(Child(MoveArmServer, parameters={"steps": 1}))
    moving = await start(rig, TARGET)
    assert [feedback.progress_percentage async for feedback in moving] == [100.0]
    assert (await moving).final_angles.tolist() == TARGET


async def test_a_cancel_ends_in_the_middle_and_the_next_goal_runs_normally(rig: Rig) -> None:
    await rig.start(PositionService, MoveArmServer)
    moving = await start(rig, TARGET)
    for _ in range(21):
        last = await anext(aiter(moving))
    assert await moving.cancel()
    with pytest.raises(GoalCanceled) as canceled:
        await moving
    assert rig.now == pytest.approx(2.0), "at once"
    result = canceled.value.result
    assert (result.success, result.message) == (False, "Movement canceled")
    assert result.final_angles.tolist() == last.current_angles.tolist() == pytest.approx([a * 20 / 49 for a in TARGET])
    await rig.advance(1.0)
    assert await where(rig) == (result.final_angles.tolist(), "IDLE")
    assert moving.feedback_count == 21
    again = await start(rig, ZEROS)
    assert len([feedback async for feedback in again]) == 50
    assert (await again).success


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ([0.0] * 3, "4 joints, but 3"),
        ([0.0] * 5, "4 joints, but 5"),
        ([0.0, 3.15, 0.0, 0.0], "Joint 1"),
        ([float("nan")] * 4, "Joint 0"),
    ],
)
async def test_other_lengths_and_angles_are_rejected_and_nothing_moves(
    rig: Rig, target: list[float], words: str
) -> None:
    await rig.start(PositionService, MoveArmServer)
    with pytest.raises(GoalRejected, match=words):
        await start(rig, target)
    assert await where(rig) == (ZEROS, "IDLE")


async def test_half_way_the_position_service_tells_half_the_way_and_moving(rig: Rig) -> None:
    await rig.start(PositionService, MoveArmServer)
    moving = await start(rig, TARGET)
    await rig.advance(2.45)
    angles, status = await where(rig)
    assert angles == pytest.approx([angle / 2 for angle in TARGET], abs=0.02)
    assert status == "MOVING"
    assert (await moving).success
    assert await where(rig) == (TARGET, "IDLE")


async def test_feedback_that_was_received_does_not_change_any_more(rig: Rig) -> None:
    await rig.start(MoveArmServer)
    told, copies = [], []
    async for feedback in await start(rig, TARGET):
        told.append(feedback.current_angles)
        copies.append(feedback.current_angles.tolist())
    assert [angles.tolist() for angles in told] == copies
    assert len({tuple(angles) for angles in copies}) == 50


async def test_a_second_goal_begins_where_the_first_one_ended_also_when_it_preempts_it(rig: Rig) -> None:
    await rig.start(MoveArmServer)
    first = await (await start(rig, TARGET))
    second = await start(rig, [-1.0, 0.0, 0.0, 0.0])
    assert (await anext(aiter(second))).current_angles.tolist() == first.final_angles.tolist()
    await rig.advance(1.0)
    third = await start(rig, ZEROS)
    opening = await anext(aiter(third))
    with pytest.raises(GoalCanceled, match="preempted") as preempted:
        await second
    assert opening.current_angles.tolist() == preempted.value.result.final_angles.tolist()


async def test_the_arm_stays_where_it_is_when_its_server_fails(rig: Rig) -> None:
    await rig.start(PositionService, MoveArmServer)
    await start(rig, TARGET)
    await rig.advance(2.0)
    before, _ = await where(rig)
    rig.crash(MoveArmServer)
    await rig.advance(1.0)
    assert await where(rig) == (before, "IDLE")
    assert rig.incarnation(MoveArmServer) == 2


async def test_the_client_asks_moves_and_tells_each_stage_in_order(rig: Rig) -> None:
    await rig.start(PositionService, MoveArmServer, alone(ArmControlClient))
    await rig.advance(6.0)
    lines = said(rig, "arm_control_client")
    assert lines[:4] == [
        "Getting current arm position...",
        "Current position: [0.0, 0.0, 0.0, 0.0], status: IDLE",
        "Moving arm to position: [1.57, 0.78, -0.78, 0.0]",
        "Goal accepted, waiting for result...",
    ]
    assert len(lines[4:-1]) == 50
    assert lines[4] == "Feedback: Moving... 0.0% complete"
    assert lines[-2:] == ["Feedback: Moving... 100.0% complete", "Movement result: Movement completed successfully"]
    assert await where(rig) == (TARGET, "IDLE")
    assert said(rig, "move_arm_server") == [
        "Move arm server ready",
        "Executing move arm action...",
        "Moving to target: [1.57, 0.78, -0.78, 0.0]",
        "Movement completed. Final angles: [1.57, 0.78, -0.78, 0.0]",
    ]


async def test_the_server_tells_of_a_cancel(rig: Rig) -> None:
    await rig.start(MoveArmServer)
    goal = await rig.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=TARGET))
    await rig.advance(1.0)
    assert await goal.cancel()
    await goal.ended()
    assert said(rig, "move_arm_server")[-2:] == ["Received cancel request", "Movement canceled"]


async def test_the_client_says_every_second_that_it_waits(rig: Rig) -> None:
    await rig.start(alone(ArmControlClient))
    await rig.advance(3.5)
    assert said(rig, "arm_control_client") == ["Service not available, waiting again..."] * 3


async def test_a_rejected_goal_is_told_and_gives_nothing(rig: Rig) -> None:
    await rig.start(PositionService, MoveArmServer, alone(ArmControlClient, target=[4.0, 0.0, 0.0, 0.0]))
    await rig.advance(1.0)
    lines = said(rig, "arm_control_client")
    assert lines[-2].startswith("Goal rejected: Joint 0 cannot go to 4.0 rad")
    assert lines[-1] == "The arm was not moved"
    assert await where(rig) == (ZEROS, "IDLE")


async def test_the_program_ends_when_its_client_is_done(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.until(lambda: not system.running)
    assert rig.now == pytest.approx(5.0)
