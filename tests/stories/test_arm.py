"""The tutorials' arm in three processes (X-06): a position service, a server that moves the arm, and a client of both."""

from __future__ import annotations

import math
import time

import pytest

from actors import GoalCanceled, System
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition, GetPosition_Response
from robot.tutorials.robot_arm import GET_CURRENT_POSITION, MOVE_ARM
from tests.stories.conftest import Start

pytestmark = pytest.mark.realtime

ARM = ("robot.tutorials", "robot_arm", "--only")


async def position(observer: System) -> GetPosition_Response:
    return await observer.node("observer").call(GET_CURRENT_POSITION, GetPosition.Request())


async def test_the_client_moves_the_arm_by_the_servers_of_two_other_processes(start: Start, observer: System) -> None:
    await start(*ARM, "position_service")
    await start(*ARM, "move_arm_server")

    client = await start(*ARM, "arm_control_client")

    assert await client.ended() == 0
    said = [line.split("] ", 1)[1].rsplit("[", 1)[0].rstrip() for line in client.lines]
    feedback = [line for line in said if line.startswith("Feedback: ")]
    assert len(feedback) == 50
    assert (feedback[0], feedback[-1]) == (
        "Feedback: Moving... 0.0% complete",
        "Feedback: Moving... 100.0% complete",
    )
    assert "Current position: [0.0, 0.0, 0.0, 0.0], status: IDLE" in said
    assert said[said.index(feedback[-1]) + 1] == "Movement result: Movement completed successfully"
    reached = await position(observer)
    assert reached.joint_angles.tolist() == pytest.approx([1.57, 0.78, -0.78, 0.0])
    assert reached.arm_status == "IDLE"


async def test_a_motion_is_canceled_half_way_and_the_position_is_told_quickly(start: Start, observer: System) -> None:
    await start(*ARM, "position_service")
    await start(*ARM, "move_arm_server")
    me = observer.node("observer")
    await me.wait_for(GET_CURRENT_POSITION, timeout=20.0)
    await me.wait_for(MOVE_ARM, timeout=20.0)

    seconds: list[float] = []
    with pytest.raises(GoalCanceled) as canceled:
        async with me.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=(1.0, 0.0, 0.0, 0.0))) as moving:
            async for feedback in moving:
                begun = time.perf_counter()
                told = await position(observer)
                seconds.append(time.perf_counter() - begun)
                assert told.joint_angles[0] >= feedback.current_angles[0] - 1e-9
                if feedback.progress_percentage >= 10.0:
                    await moving.cancel()
            await moving

    result = canceled.value.result
    assert isinstance(result, MoveArm.Result)
    assert not result.success
    assert 0.05 < result.final_angles[0] < 0.5
    after = await position(observer)
    assert math.isclose(after.joint_angles[0], result.final_angles[0])
    assert sorted(seconds)[len(seconds) // 2] < 0.1
