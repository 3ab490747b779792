"""The humanoid that walks to a place (Y-08)."""

from __future__ import annotations

import math
from typing import TypeAlias

import pytest

from actors import Child, GoalAborted, GoalCanceled, GoalRejected
from actors.testing import Rig
from actors.typing import Goal
from robot.interfaces.tutorials.your_package.action import HumanoidNav, HumanoidNav_Feedback, HumanoidNav_Result
from robot.scenes.scene import Box, Cylinder
from robot.tutorials.humanoid_navigation import HUMANOID_NAVIGATE, HumanoidNavClient, HumanoidNavServer, tree
from tests.robot.stage import said, warnings
from tests.robot.tutorials.kit import alone, increasing

Feedback: TypeAlias = HumanoidNav_Feedback
Result: TypeAlias = HumanoidNav_Result


async def begin(rig: Rig, *target: float, avoid: bool = True) -> Goal[Result, Feedback]:
    return await rig.send_goal(HUMANOID_NAVIGATE, HumanoidNav.Goal(target_position=list(target), avoid_obstacles=avoid))


async def test_the_goal_of_the_tutorial_takes_57_seconds(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    goal = await begin(rig, 5.0, 3.0, 0.0)
    told = [feedback async for feedback in goal]
    result = await goal
    assert rig.now == pytest.approx(57.4)
    assert [feedback.current_waypoint for feedback in told] == list(range(10, 571, 10))
    assert told[0].status_message == "Navigating... 5.73m to go"
    assert (result.success, result.message) == (True, "Navigation completed to [4.92, 2.95]")
    x, y, theta = result.final_position
    assert math.hypot(5.0 - x, 3.0 - y) == pytest.approx(0.091, abs=5e-4)
    assert theta == 0.0
    assert increasing(-feedback.distance_remaining for feedback in told)


async def test_the_server_tells_of_every_stage(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    await (await begin(rig, 0.3, 0.0, 0.0))
    canceled = await begin(rig, 5.0, 0.0, 0.0)
    await rig.advance(0.25)
    assert await canceled.cancel()
    await canceled.ended()
    assert said(rig, "humanoid_nav_action_server") == [
        "Humanoid navigation action server ready",
        "Received navigation goal request",
        "Executing navigation goal...",
        "Feedback: Navigating... 0.20m to go",
        "Feedback: Navigating... 0.10m to go",
        "Goal succeeded: Navigation completed to [0.20, 0.00]",
        "Received navigation goal request",
        "Executing navigation goal...",
        "Received cancel request",
        "Goal canceled",
    ]


async def test_how_near_is_there_is_a_parameter(rig: Rig) -> None:
    await rig.start(Child(HumanoidNavServer, parameters={"tolerance": 0.5}))
    result = await (await begin(rig, 1.0, 0.0, 0.0))
    assert result.final_position[0] == pytest.approx(0.5, abs=0.011)


async def test_the_heading_that_is_told_is_the_true_one_and_is_reached(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    goal = await begin(rig, 0.3, 0.0, 2.0)  # 20 ticks to walk, 39 to turn
    told = [feedback async for feedback in goal]
    assert [feedback.current_position[2] for feedback in told] == pytest.approx([0.5, 1.0, 1.5])
    assert (await goal).final_position[2] == pytest.approx(2.0, abs=0.05)
    assert rig.node(HumanoidNavServer).pose.yaw == pytest.approx(2.0, abs=0.05)


async def test_goals_run_one_after_another_and_the_second_starts_where_the_first_ended(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    first, second = await begin(rig, 1.0, 0.0, 0.0), await begin(rig, 1.0, 1.0, 0.0)
    end = (await first).final_position
    told = await second.__anext__()
    assert told.current_position == pytest.approx([end[0], end[1] + 0.1, 0.0], abs=0.02)
    assert (await second).success
    third, fourth = await begin(rig, 0.0, 0.0, 0.0), await begin(rig, 2.0, 2.0, 0.0)
    await rig.advance(1.0)
    assert await third.cancel()
    assert (await fourth).success


def distance_to_line(told: list[Feedback], x: float, y: float) -> float:
    return min(math.hypot(f.current_position[0] - x, f.current_position[1] - y) for f in told)


async def test_who_avoids_obstacles_keeps_off_them_and_arrives(rig: Rig) -> None:
    await rig.start(Child(HumanoidNavServer, args=((Cylinder(1.5, 0.0, 0.3),),)))
    goal = await begin(rig, 3.0, 0.0, 0.0)
    told = [feedback async for feedback in goal]
    assert (await goal).success
    assert distance_to_line(told, 1.5, 0.0) - 0.3 >= 0.2
    assert math.hypot(rig.node(HumanoidNavServer).pose.x - 3.0, rig.node(HumanoidNavServer).pose.y) <= 0.1


async def test_who_does_not_walks_straight_into_them_which_aborts(rig: Rig) -> None:
    await rig.start(Child(HumanoidNavServer, args=((Cylinder(1.5, 0.0, 0.3),),)))
    goal = await begin(rig, 3.0, 0.0, 0.0, avoid=False)
    with pytest.raises(GoalAborted, match="contact with an obstacle at") as caught:
        await goal
    assert isinstance(caught.value.result, HumanoidNav.Result)
    assert caught.value.result.final_position == pytest.approx([1.2, 0.0, 0.0], abs=0.011)
    assert not caught.value.result.success


async def test_a_goal_in_an_obstacle_is_rejected_and_one_behind_walls_aborts(rig: Rig) -> None:
    walls = tuple(Box(x, y, *size) for x, y, size in [
        (2.0, 1.0, (2.0, 0.1)), (2.0, -1.0, (2.0, 0.1)), (1.0, 0.0, (0.1, 2.1)), (3.0, 0.0, (0.1, 2.1)),
    ])  # fmt: skip
    await rig.start(Child(HumanoidNavServer, args=(walls,)))
    with pytest.raises(GoalRejected, match="GoalBlocked"):
        await begin(rig, 1.0, 0.0, 0.0)
    with pytest.raises(GoalAborted, match="Unreachable"):
        await (await begin(rig, 2.0, 0.0, 0.0))


async def test_near_goals_finish_at_once_and_short_ones_are_told_of(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    near = await begin(rig, 0.09, 0.0, 0.0)
    assert (await near).success
    assert rig.now == 0.0
    short = await begin(rig, 0.15, 0.0, 0.0)
    assert [feedback.current_waypoint async for feedback in short] == [5]


@pytest.mark.parametrize(
    ("target", "why"),
    [((1.0, 2.0), "3 numbers, not 2"), ((math.nan, 0.0, 0.0), "NaN"), ((0.0, math.inf, 0.0), "infinity")],
)
async def test_what_is_no_place_is_rejected(rig: Rig, target: tuple[float, ...], why: str) -> None:
    await rig.start(HumanoidNavServer)
    with pytest.raises(GoalRejected, match=why):
        await begin(rig, *target)
    assert why in warnings(rig, "humanoid_nav_action_server")[0]


async def test_a_cancel_tells_where_the_humanoid_stands(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    goal = await begin(rig, 5.0, 0.0, 0.0)
    await rig.advance(2.05)
    assert await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    result = caught.value.result
    assert isinstance(result, HumanoidNav.Result)
    assert (result.success, result.message, rig.now) == (False, "Goal canceled", pytest.approx(2.05))
    assert result.final_position == pytest.approx([0.2, 0.0, 0.0])


async def test_a_cancel_after_the_arrival_comes_too_late(rig: Rig) -> None:
    await rig.start(HumanoidNavServer)
    goal = await begin(rig, 0.2, 0.0, 0.0)
    await rig.advance(1.0)
    assert not await goal.cancel()
    assert (await goal).success


async def test_the_client_tells_all_of_it_and_ends(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.advance(60.0)
    lines = said(rig, "humanoid_nav_action_client")
    assert lines[0] == "Goal accepted :)"
    assert lines[1] == "Received feedback: Navigating... 5.73m to go"
    assert sum(line.startswith("Received feedback: ") for line in lines) == 57
    assert lines[-1] == "Result: Navigation completed to [4.92, 2.95]"
    assert not system.running


async def test_a_client_whose_goal_is_rejected_ends(rig: Rig) -> None:
    await rig.start(HumanoidNavServer, alone(HumanoidNavClient, target=[1.0, 2.0]))
    await rig.advance(1.0)
    assert said(rig, "humanoid_nav_action_client")[0].startswith("Goal rejected :(")
    assert rig.state(HumanoidNavClient).state == "stopped"
