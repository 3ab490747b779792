"""Moving to a position (Y-03, the part without the command line)."""

from __future__ import annotations

import math
from typing import TypeAlias

import pytest

from actors import Child, GoalCanceled, GoalRejected, GoalStatus, Node, every
from actors.testing import Rig
from actors.typing import Goal
from robot.interfaces.tutorials.my_robot_interfaces.action import (
    MoveToPosition,
    MoveToPosition_Feedback,
    MoveToPosition_Result,
)
from robot.tutorials.move_to_position import MOVE_TO_POSITION, MoveClient, MoveServer, tree
from tests.robot.stage import said, warnings
from tests.robot.tutorials.kit import alone, increasing

Feedback: TypeAlias = MoveToPosition_Feedback
Result: TypeAlias = MoveToPosition_Result


def to(x: float, y: float, theta: float = 0.0) -> MoveToPosition.Goal:
    return MoveToPosition.Goal(target_x=x, target_y=y, target_theta=theta)


async def watched(goal: Goal[Result, Feedback]) -> list[Feedback]:
    """All feedback of a goal, to its end."""
    return [feedback async for feedback in goal]


async def moved(rig: Rig, x: float, y: float, theta: float = 0.0) -> Result:
    return await (await rig.send_goal(MOVE_TO_POSITION, to(x, y, theta)))


async def test_five_metres_take_ten_seconds(rig: Rig) -> None:
    await rig.start(MoveServer)
    goal = await rig.send_goal(MOVE_TO_POSITION, to(3.0, 4.0))
    ticks = await watched(goal)
    result = await goal
    assert 99 <= len(ticks) <= 100
    assert 9.9 - 1e-6 <= result.total_time_seconds <= 10.0 + 1e-6
    assert rig.now == pytest.approx(result.total_time_seconds)
    assert (result.success, result.message) == (True, "Reached target position")
    assert math.hypot(result.final_x - 3.0, result.final_y - 4.0) < 0.0501
    assert said(rig, "move_action_server") == [
        "Move action server ready",
        "Received goal: (3.0, 4.0)",
        "Executing move...",
        f"Move completed in {result.total_time_seconds:.1f}s",
    ]


async def test_the_goal_of_the_command_line(rig: Rig) -> None:
    await rig.start(MoveServer)
    goal = await rig.send_goal(MOVE_TO_POSITION, to(2.0, 3.0))
    ticks = await watched(goal)
    result = await goal
    assert 72 <= len(ticks) <= 73
    assert 7.2 - 1e-6 <= result.total_time_seconds <= 7.3 + 1e-6
    assert math.hypot(result.final_x - 2.0, result.final_y - 3.0) < 0.0501


async def test_each_feedback_tells_one_instant_and_keeps_its_numbers(rig: Rig) -> None:
    await rig.start(MoveServer)
    ticks = await watched(await rig.send_goal(MOVE_TO_POSITION, to(3.0, 4.0)))
    for now in ticks:
        assert now.distance_remaining == pytest.approx(math.hypot(3.0 - now.current_x, 4.0 - now.current_y), abs=1e-5)
        assert now.estimated_time_remaining * 0.5 == pytest.approx(now.distance_remaining, rel=1e-6)
    assert increasing(-now.distance_remaining for now in ticks)


async def test_how_near_is_there_is_a_parameter(rig: Rig) -> None:
    await rig.start(Child(MoveServer, parameters={"tolerance": 0.5}))
    result = await (await rig.send_goal(MOVE_TO_POSITION, MoveToPosition.Goal(target_x=2.0)))
    assert result.final_x == pytest.approx(1.5, abs=0.051)


async def test_who_is_there_already_need_not_move(rig: Rig) -> None:
    await rig.start(MoveServer)
    goal = await rig.send_goal(MOVE_TO_POSITION, to(0.04, 0.0))
    assert await watched(goal) == []
    result = await goal
    assert (result.success, result.total_time_seconds, rig.now) == (True, 0.0, 0.0)


async def test_a_cancel_stops_the_robot_within_one_tick_and_tells_where_it_is(rig: Rig) -> None:
    await rig.start(MoveServer)
    goal = await rig.send_goal(MOVE_TO_POSITION, to(3.0, 4.0))
    await rig.advance(3.05)
    assert await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    result = caught.value.result
    assert isinstance(result, MoveToPosition.Result)
    assert rig.now == pytest.approx(3.05)
    assert (result.success, result.message) == (False, "Movement canceled")
    assert (result.final_x, result.final_y) == pytest.approx((0.9, 1.2), abs=1e-5)
    assert result.total_time_seconds == pytest.approx(3.05)
    assert "Received cancel request" in said(rig, "move_action_server")
    before, count = rig.node(MoveServer).pose, goal.feedback_count
    await rig.advance(5.0)
    assert (rig.node(MoveServer).pose, goal.feedback_count) == (before, count)  # it stays, and nothing more is told


async def test_the_robot_ends_with_the_heading_that_was_asked_for(rig: Rig) -> None:
    await rig.start(MoveServer)
    await moved(rig, 1.0, 0.0, 1.0)
    assert rig.node(MoveServer).pose.yaw == pytest.approx(1.0, abs=0.05)
    await moved(rig, 1.0, 0.0, -3.0)  # on the spot, and the shorter way: over the back
    assert rig.node(MoveServer).pose.yaw == pytest.approx(-3.0, abs=0.05)


@pytest.mark.parametrize("target", [(math.nan, 0.0), (0.0, math.inf), (0.0, 0.0, math.nan)])
async def test_what_is_no_place_is_rejected_with_a_reason(rig: Rig, target: tuple[float, ...]) -> None:
    await rig.start(MoveServer)
    with pytest.raises(GoalRejected, match="holds NaN or infinity"):
        await moved(rig, *target)
    assert warnings(rig, "move_action_server")[0].startswith("Goal rejected: the target (")
    assert rig.node(MoveServer).pose.x == 0.0
    assert (await moved(rig, 0.2, 0.0)).success


async def test_the_second_goal_starts_where_the_first_ended(rig: Rig) -> None:
    await rig.start(MoveServer)
    await moved(rig, 1.0, 0.0)
    assert 1.9 - 1e-6 <= (await moved(rig, 1.0, 1.0)).total_time_seconds <= 2.1 + 1e-6


async def test_a_clock_that_is_set_back_does_not_make_durations_negative(rig: Rig) -> None:
    await rig.start(MoveServer)
    goal = await rig.send_goal(MOVE_TO_POSITION, to(1.0, 0.0))
    await rig.advance(1.0)
    rig.system.clock.shift_wall(-3600.0)
    assert (await goal).total_time_seconds == pytest.approx(1.9, abs=0.11)


async def test_a_second_goal_preempts_the_first_and_each_has_one_result(rig: Rig) -> None:
    await rig.start(MoveServer)
    first = await rig.send_goal(MOVE_TO_POSITION, to(3.0, 4.0))
    await rig.advance(2.05)
    second = await rig.send_goal(MOVE_TO_POSITION, to(0.0, 0.0))
    with pytest.raises(GoalCanceled, match="preempted by a newer goal"):
        await first
    assert (await second).total_time_seconds == pytest.approx(1.9, abs=0.11)  # back from 1 m
    assert first.status is GoalStatus.CANCELED and second.status is GoalStatus.SUCCEEDED


async def test_a_cancel_that_comes_too_late_does_not_hit_the_next_goal(rig: Rig) -> None:
    await rig.start(MoveServer)
    first = await rig.send_goal(MOVE_TO_POSITION, to(0.5, 0.0))
    await first
    second = await rig.send_goal(MOVE_TO_POSITION, to(1.0, 0.0))
    assert not await first.cancel()
    assert (await second).success


async def test_a_robot_whose_driver_has_failed_is_where_it_was(rig: Rig) -> None:
    await rig.start(MoveServer)
    await moved(rig, 1.0, 0.0)
    rig.crash(MoveServer)
    await rig.settled()
    assert (await moved(rig, 1.0, 1.0)).total_time_seconds == pytest.approx(2.0, abs=0.11)


class Ticking(Node):
    """100 Hz beside the moving robot."""

    ticks = 0

    @every(hz=100)
    def tick(self) -> None:
        self.ticks += 1


async def test_a_moving_robot_holds_nobody_up(rig: Rig) -> None:
    await rig.start(MoveServer, Ticking)
    await moved(rig, 3.0, 4.0)
    assert rig.node(Ticking).ticks >= 0.99 * 100 * rig.now


async def test_the_client_tells_how_it_goes_and_ends(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.advance(12.0)
    lines = said(rig, "move_action_client")
    assert lines[:2] == ["Sending goal: (3.0, 4.0)", "Goal accepted!"]
    assert lines[2] == "Position: (0.03, 0.04) | Remaining: 4.95m"
    assert sum(line.startswith("Position: ") for line in lines) in (99, 100)
    assert lines[-1].startswith("Arrived at (2.97, 3.96) in 9.9s")
    assert not system.running


async def test_a_client_whose_goal_is_rejected_ends_too(rig: Rig) -> None:
    await rig.start(MoveServer, alone(MoveClient, x=math.inf))
    await rig.advance(1.0)
    assert said(rig, "move_action_client")[-1].startswith("Goal rejected: ")
    assert rig.state(MoveClient).state == "stopped"


async def test_a_client_whose_goal_is_preempted_says_what_has_failed(rig: Rig) -> None:
    await rig.start(MoveServer, alone(MoveClient))
    await rig.advance(1.0)
    await rig.send_goal(MOVE_TO_POSITION, to(0.0, 0.0))
    await rig.advance(0.1)
    assert warnings(rig, "move_action_client") == ["Failed: Movement canceled"]
