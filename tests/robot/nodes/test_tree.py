"""The assembled robot (Y-46, Z-02, Z-04, Z-07): everything answers soon after the start, and nothing is left after the end."""

from __future__ import annotations

import asyncio
import threading

import pytest

from actors import GoalAborted, execute, open_node, run
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.logs import WARN, LogRecord
from actors.testing import Rig
from robot import Robot
from robot.contracts import (
    EMERGENCY_STOP,
    ENABLE,
    GET_BATTERY_STATUS,
    GET_STATUS,
    JOINT_STATES,
    MOVE_TO_POSITION,
    SIT,
    STAND,
    WALK,
)
from robot.interfaces.tutorials.my_robot_interfaces.action import MoveToPosition
from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus
from tests.robot.stage import robot


async def test_within_three_seconds_everything_of_the_robot_answers(rig: Rig) -> None:
    system = await rig.start(robot())
    joints = rig.probe(JOINT_STATES)
    await rig.advance(0.5)
    battery = await rig.call(GET_BATTERY_STATUS, GetBatteryStatus.Request(robot_id="robot_01"))
    assert battery.percentage > 50.0
    assert (await rig.call(STAND, Trigger.Request())).success
    assert (await rig.call(WALK, Trigger.Request())).success
    assert (await rig.call(ENABLE, SetBool.Request(data=True))).success
    assert (await rig.call(EMERGENCY_STOP, SetBool.Request(data=False))).success
    goal = await rig.send_goal(MOVE_TO_POSITION, MoveToPosition.Goal(target_x=1.0))
    await rig.advance(2.5)
    assert rig.now <= 3.0 + 1e-9
    feedback = await anext(aiter(goal))
    assert feedback.distance_remaining > 0.0
    assert len(joints) == pytest.approx(3.0 * 200.0, abs=3)
    status = await rig.call(GET_STATUS, Trigger.Request())
    assert "- Battery: 9" in status.message or "- Battery: 8" in status.message
    assert "- Walking: True" in status.message
    nodes = {state.identity.name for state in system.nodes.values()}
    assert {"battery", "navigation", "gait", "proprioception", "lidar", "safety_monitor", "robot_controller"} <= nodes
    await goal.cancel()
    await rig.advance(0.2)


async def test_a_goal_ends_when_somebody_sits_the_robot_down(rig: Rig) -> None:
    await rig.start(robot())
    await rig.call(STAND, Trigger.Request())
    await rig.advance(3.0)
    goal = await rig.send_goal(MOVE_TO_POSITION, MoveToPosition.Goal(target_x=4.0))
    await rig.advance(1.5)
    await rig.call(SIT, Trigger.Request())
    with pytest.raises(GoalAborted, match="the robot has stopped walking: its gait is 'sit'"):
        await goal


async def test_after_the_end_no_task_and_no_thread_is_left(rig: Rig) -> None:
    tasks, threads = asyncio.all_tasks(), set(threading.enumerate())
    await rig.start(robot())
    await rig.advance(1.0)
    assert asyncio.all_tasks() > tasks
    await rig.close()  # raises Leak for whatever outlives it: tasks, threads, endpoints, goals
    assert asyncio.all_tasks() == tasks
    assert {thread for thread in set(threading.enumerate()) - threads if "asyncio" not in thread.name} == set()


@pytest.mark.parametrize("seed", [0, 3])
def test_a_healthy_start_warns_of_nothing(seed: int) -> None:
    lines: list[LogRecord] = []
    answers: list[Trigger.Response] = []

    async def start() -> None:
        async with run(Robot("warehouse", seed=seed).tree, sinks=(lines.append,)) as system:
            await system.clock.sleep(0.05)
            async with open_node("asker", system=system) as asker:
                answers.append(await asker.call(STAND, Trigger.Request()))
            await system.clock.sleep(4.0)

    execute(start, clock="virtual")
    assert [line.event for line in lines if line.level >= WARN] == []
    assert [answer.message for answer in answers] == ["Robot is standing up"]
