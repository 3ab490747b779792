"""The Fibonacci action (Y-28), and the same as a stand-in for navigation (Y-19)."""

from __future__ import annotations

import asyncio

import pytest

from actors import Aborted, Done, GoalAborted, GoalCanceled, GoalRejected, GoalStatus, Node, Steps
from actors.interfaces.example_interfaces.action import Fibonacci as Example
from actors.interfaces.example_interfaces.action import Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.runtime.retry import retry
from actors.supervision.policy import Backoff
from actors.testing import Rig
from robot.interfaces.tutorials.my_robot_pkg.action import Fibonacci
from robot.tutorials import navigate_stand_in
from robot.tutorials.fibonacci import FIBONACCI, FibonacciClient, FibonacciServer, tree
from robot.tutorials.navigate_stand_in import NAVIGATE_TO_GOAL, NavigationClient, NavigationServer
from tests.robot.stage import said
from tests.robot.tutorials.kit import alone

TEN = [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]


def order(number: int) -> Fibonacci.Goal:
    return Fibonacci.Goal(order=number)


async def test_order_ten_is_eleven_numbers_nine_feedbacks_and_nine_seconds(rig: Rig) -> None:
    await rig.start(FibonacciServer)
    goal = await rig.send_goal(FIBONACCI, order(10))
    told = [feedback.sequence.tolist() async for feedback in goal]
    assert (await goal).sequence.tolist() == TEN
    assert told == [TEN[: k + 2] for k in range(1, 10)]  # each is a snapshot of its own
    assert rig.now == 9.0


@pytest.mark.parametrize(("number", "expected"), [(1, [0, 1]), (0, [0])])
async def test_short_sequences_come_at_once(rig: Rig, number: int, expected: list[int]) -> None:
    await rig.start(FibonacciServer)
    goal = await rig.send_goal(FIBONACCI, order(number))
    assert (await goal).sequence.tolist() == expected
    assert (goal.feedback_count, rig.now) == (0, 0.0)


async def test_the_largest_order_that_fits_and_those_that_are_rejected(rig: Rig) -> None:
    await rig.start(FibonacciServer)
    assert (await (await rig.send_goal(FIBONACCI, order(46)))).sequence[-1] == 1836311903
    for number, why in ((47, "beyond 32 bits"), (-1, "negative")):
        with pytest.raises(GoalRejected, match=why):
            await rig.send_goal(FIBONACCI, order(number))


async def test_a_cancel_hands_over_what_there_is(rig: Rig) -> None:
    await rig.start(FibonacciServer)
    goal = await rig.send_goal(FIBONACCI, order(10))
    for _ in range(3):
        await goal.__anext__()
    assert await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    assert isinstance(caught.value.result, Fibonacci.Result)
    assert caught.value.result.sequence.tolist() == [0, 1, 1, 2, 3]
    assert goal.status is GoalStatus.CANCELED
    assert said(rig, "fibonacci_action_server")[-1] == "Goal canceled"


async def test_three_goals_at_once_are_all_right(rig: Rig) -> None:
    await rig.start(FibonacciServer)
    goals = [await rig.send_goal(FIBONACCI, order(number)) for number in (10, 5, 7)]
    results = await asyncio.gather(*(goal.ended() for goal in goals))
    assert [outcome.result.sequence.tolist() for outcome in results] == [TEN, TEN[:6], TEN[:8]]
    assert rig.now == 9.0


async def test_both_sides_say_what_they_do_and_the_client_ends(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.advance(10.0)
    server, client = said(rig, "fibonacci_action_server"), said(rig, "fibonacci_action_client")
    assert server[:3] == ["Received goal request", "Executing goal...", "Feedback: [0, 1, 1]"]
    assert server[-1] == client[-1] == f"Result: {TEN}"
    assert client[0] == "Goal accepted"
    assert client[1:-1] == [f"Received feedback: {TEN[: k + 2]}" for k in range(1, 10)]
    assert not system.running


async def test_the_server_tells_of_a_cancel(rig: Rig) -> None:
    await rig.start(FibonacciServer)
    goal = await rig.send_goal(FIBONACCI, order(10))
    await rig.advance(1.5)
    assert await goal.cancel()
    await goal.ended()
    assert said(rig, "fibonacci_action_server")[-2:] == ["Received cancel request", "Goal canceled"]


async def test_a_client_whose_goal_is_rejected_ends(rig: Rig) -> None:
    await rig.start(FibonacciServer, alone(FibonacciClient, order=47))
    await rig.advance(1.0)
    assert said(rig, "fibonacci_action_client")[0].startswith("Goal rejected: order 47")
    assert rig.state(FibonacciClient).state == "stopped"


# -- the stand-in -----------------------------------------------------------------------------------------------------------


async def test_the_stand_in_tells_the_real_sequence(rig: Rig) -> None:
    await rig.start(NavigationServer)
    goal = await rig.send_goal(NAVIGATE_TO_GOAL, Example.Goal(order=10))
    told = [feedback.sequence.tolist() async for feedback in goal]
    assert told == [TEN[: k + 1] for k in range(1, 11)]
    assert (await goal).sequence.tolist() == TEN
    assert rig.now == pytest.approx(1.0)


async def test_a_canceled_goal_has_the_part_that_was_done(rig: Rig) -> None:
    await rig.start(NavigationServer)
    goal = await rig.send_goal(NAVIGATE_TO_GOAL, Example.Goal(order=10))
    await rig.advance(0.45)
    assert await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    assert isinstance(caught.value.result, Fibonacci_Result)
    assert caught.value.result.sequence.tolist() == [0, 1, 1, 2, 3]
    assert said(rig, "navigation_action_server") == [
        "Executing goal...",
        "Feedback: [0, 1]",
        "Feedback: [0, 1, 1]",
        "Feedback: [0, 1, 1, 2]",
        "Feedback: [0, 1, 1, 2, 3]",
        "Goal cancelled",
    ]


async def test_a_new_goal_preempts_the_running_one(rig: Rig) -> None:
    await rig.start(NavigationServer)
    first = await rig.send_goal(NAVIGATE_TO_GOAL, Example.Goal(order=40))
    await rig.advance(1.0)
    second = await rig.send_goal(NAVIGATE_TO_GOAL, Example.Goal(order=3))
    with pytest.raises(GoalCanceled, match="preempted by a newer goal"):
        await first
    assert (await second).sequence.tolist() == [0, 1, 1, 2]


async def test_the_client_tells_ten_feedbacks_and_ends(rig: Rig) -> None:
    system = await rig.start(navigate_stand_in.tree())
    await rig.advance(2.0)
    lines = said(rig, "navigation_action_client")
    assert lines[:2] == ["Sending goal...", "Goal accepted"]
    assert sum(line.startswith("Received feedback: ") for line in lines) == 10
    assert lines[-1] == f"Result: {TEN}"
    assert not system.running


@pytest.mark.parametrize(
    ("after", "line", "numbers"), [(0.35, "Goal cancelled", TEN[:4]), (5.0, "Goal could not be cancelled", TEN)]
)
async def test_the_client_says_whether_its_cancel_came_in_time(
    rig: Rig, after: float, line: str, numbers: list[int]
) -> None:
    await rig.start(NavigationServer, alone(NavigationClient, cancel_after=after))
    await rig.advance(6.0)
    assert said(rig, "navigation_action_client")[-2:] == [line, f"Result: {numbers}"]


async def test_a_client_without_a_server_waits_and_a_rejected_one_ends(rig: Rig) -> None:
    await rig.start(alone(NavigationClient, patience=2.0))
    await rig.advance(3.0)
    lines = said(rig, "navigation_action_client")
    assert lines[:2] == ["Waiting for action server..."] * 2
    assert "nobody serves /navigate_to_goal" in lines[2]


async def test_a_stand_in_goal_that_cannot_be_is_rejected(rig: Rig) -> None:
    await rig.start(NavigationServer, alone(NavigationClient, order=47))
    await rig.advance(1.0)
    assert said(rig, "navigation_action_client")[-1].startswith("Goal rejected: order 47")


class Moody(Node):
    """Fails twice, then works."""

    attempts = 0

    @NAVIGATE_TO_GOAL.serve()
    async def navigate(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        self.attempts += 1
        await self.clock.sleep(0.1)
        if self.attempts == 1:
            raise OSError("the map is upside down")
        if self.attempts == 2:
            yield Aborted(Example.Result(), "lost")
            return
        yield Done(Example.Result(sequence=[0, 1]))


async def test_a_retry_outlives_two_aborted_goals(rig: Rig) -> None:
    await rig.start(Moody)
    failures: list[Exception] = []
    result = await retry(
        rig.me,
        NAVIGATE_TO_GOAL,
        Example.Goal(order=1),
        attempts=3,
        backoff=Backoff(0.5, 2.0, jitter=0.0),
        on_failure=failures.append,
    )
    assert result.sequence.tolist() == [0, 1]
    assert [type(failure) for failure in failures] == [GoalAborted, GoalAborted]
    assert rig.node(Moody).attempts == 3
    assert rig.now == pytest.approx(0.1 + 0.5 + 0.1 + 1.0 + 0.1)
