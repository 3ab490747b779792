"""Actions: goals, feedback, one result, and cancellation at any time; whatever happens, exactly one outcome."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Callable
from types import FunctionType
from typing import Any

import anyio
import numpy as np
import pytest

from actors import (
    Aborted,
    Action,
    ActionUnavailable,
    Backoff,
    Child,
    Done,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    GoalStatus,
    Node,
    Reject,
    StartFailed,
    Steps,
    Stop,
    every,
    open_node,
    run,
    temporary,
    transient,
)
from actors.actions import parallel, queue
from actors.actions.client import Goal
from actors.contracts.contracts import Arrivals
from actors.errors import NodeRestarting, NotRunning, NotStarted, WrongType
from actors.inbox.control import NodeExit
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.tf2_msgs.action import LookupTransform
from actors.testing import Rig
from tests.stage import ADD, COUNT, NUMBERS, events, number, order, result, step, total, two

Body = Steps[Fibonacci.Feedback, Fibonacci.Result]
Handle = Goal[Fibonacci.Result, Fibonacci.Feedback]


class Counter(Node):
    """Counts to `order`, one feedback a second; the result is all it counted. Stopped early, it hands over what it has."""

    def __init__(self) -> None:
        self.log_of: list[tuple[float, str]] = []

    def note(self, what: str) -> None:
        self.log_of.append((self.clock.now(), what))

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Body:
        self.note(f"begin {goal.order}")
        counted: list[int] = []
        try:
            for value in range(1, goal.order + 1):
                await self.clock.sleep(1.0)
                counted.append(value)
                yield step(*counted)
        finally:
            self.note(f"end {goal.order}")
        yield Done(result(*counted))


def serving(body: Callable[[Any, Fibonacci.Goal], Body], arrivals: Arrivals = "reject", **members: Any) -> type[Node]:
    """A node class that serves COUNT by (a copy of) `body`, which may be a method of a class that serves it already."""
    function: Any = body
    copy: Any = FunctionType(function.__code__, function.__globals__, "count", None, function.__closure__)
    return type("Server", (Node,), {"count": COUNT.serve(arrivals=arrivals)(copy), **members})


class Moment:
    """An inbox item of the tests: does something in the node's turn, right after what came before it."""

    label = "moment"

    def __init__(self, act: Callable[[], object]) -> None:
        self.act = act

    def run(self) -> None:
        self.act()


def server_of(rig: Rig) -> Any:
    server = rig.system.graph.action("/count").server
    assert server is not None
    return server


# -- the way of a goal -----------------------------------------------------------------------------------------------


async def test_goal_feedback_result(rig: Rig) -> None:
    await rig.start(Counter)
    seen: list[list[int]] = []
    async with rig.me.send_goal(COUNT, order(3)) as goal:
        async for feedback in goal:
            seen.append(list(feedback.sequence))
        answer = await goal
    assert seen == [[1], [1, 2], [1, 2, 3]]
    assert list(answer.sequence) == [1, 2, 3]
    assert goal.status is GoalStatus.SUCCEEDED
    assert goal.done
    assert rig.now == 3.0
    assert (await goal) == answer  # it may be awaited again


async def test_the_states_come_in_order(rig: Rig) -> None:
    await rig.start(Counter)
    handle: Handle = rig.me.send_goal(COUNT, order(2))
    seen = [handle.status]
    assert repr(handle) == "<goal not sent for /count: UNKNOWN>"
    assert (handle.goal_id, handle.feedback_count, handle.dropped) == (b"", 0, 0)
    assert not handle.done
    await handle.send()
    seen.append(handle.status)
    server = server_of(rig)
    assert repr(server) == "<server of /count in /counter: 1 running, 0 waiting>"
    await rig.advance(1.0)
    await handle.cancel()
    seen.append(handle.status)
    await rig.quiet()
    seen.append(handle.status)
    assert seen == [GoalStatus.UNKNOWN, GoalStatus.EXECUTING, GoalStatus.CANCELING, GoalStatus.CANCELED]
    assert repr(handle) == f"<goal {handle.goal_id.hex()[:8]} for /count: CANCELED>"


async def test_a_goal_that_waits_is_accepted_and_one_that_runs_executes(rig: Rig) -> None:
    await rig.start(serving(Counter.count, queue(1), note=lambda self, what: None))
    first, second = await rig.send_goal(COUNT, order(2)), await rig.send_goal(COUNT, order(1))
    assert (first.status, second.status) == (GoalStatus.EXECUTING, GoalStatus.ACCEPTED)
    await rig.advance(2.0)
    assert (first.status, second.status) == (GoalStatus.SUCCEEDED, GoalStatus.EXECUTING)
    await rig.advance(1.0)
    assert second.status is GoalStatus.SUCCEEDED


async def test_each_feedback_is_a_value_of_its_own(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(3))
    collected = [feedback async for feedback in goal]
    assert [len(feedback.sequence) for feedback in collected] == [1, 2, 3]


async def test_feedback_is_keep_last_ten_and_losses_are_counted(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(25))
    await rig.advance(30.0)
    assert (goal.feedback_count, goal.dropped) == (25, 15)
    assert [len(feedback.sequence) async for feedback in goal] == list(range(16, 26))


async def test_two_tasks_may_await_a_goal_and_a_third_its_feedback(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(2))

    async def watch() -> int:
        return len([feedback async for feedback in goal])

    async def wait() -> Fibonacci.Result:
        return await goal

    outcomes = tuple(await asyncio.gather(wait(), watch(), wait()))
    assert outcomes == (result(1, 2), 2, result(1, 2))


async def test_an_outcome_can_be_had_as_a_value(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(5))
    await goal.cancel("changed my mind")
    outcome = await goal.ended()
    assert repr(outcome) == "<CANCELED: changed my mind>"
    assert (outcome.status, outcome.result, outcome.reason) == (GoalStatus.CANCELED, None, "changed my mind")


async def goal_ids(seed: int, *others: type[Node]) -> list[bytes]:
    """The ids of three goals that one node starts, in a system with `others`."""
    ids: list[bytes] = []

    class Starter(Node):
        async def on_start(self) -> None:
            for _ in range(3):
                goal = self.send_goal(COUNT, order(1))
                await goal.send()
                ids.append(goal.goal_id)

    server = serving(Counter.count, "parallel", note=lambda self, what: None)
    async with run(server, *others, Starter, seed=seed, sinks=()):
        return ids


async def test_the_goal_ids_of_a_node_come_from_the_seed_and_depend_on_no_other_node() -> None:
    class Eager(Node):
        async def on_start(self) -> None:
            await self.send_goal(COUNT, order(1)).send()

    ids = await goal_ids(7)
    assert await goal_ids(7, Eager) == ids
    assert not set(ids) & set(await goal_ids(8))
    assert len(set(ids)) == 3
    assert all(uuid.UUID(bytes=goal_id).version == 4 for goal_id in ids)


async def test_a_node_that_is_opened_again_under_its_name_draws_other_ids(rig: Rig) -> None:
    """It used to draw the same ones, and its first goal was refused: that id was in use."""
    await rig.start(Counter)
    ids: list[bytes] = []
    for _ in range(3):
        async with open_node("client") as node, node.send_goal(COUNT, order(1)) as goal:
            await goal
            ids.append(goal.goal_id)
    assert len(set(ids)) == 3


async def test_while_a_goal_runs_its_node_answers_and_ticks(rig: Rig) -> None:
    class Worker(Counter):
        ticks = 0

        @every(hz=100)
        async def tick(self) -> None:
            self.ticks += 1

        @ADD.serve()
        async def add(self, request: Any) -> Any:
            return total(request.a + request.b)

    await rig.start(Worker)
    goal = await rig.send_goal(COUNT, order(10))
    await rig.advance(5.0)
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    assert rig.now == 5.0
    assert rig.node(Worker).ticks == 500
    assert goal.status is GoalStatus.EXECUTING


# -- refusals --------------------------------------------------------------------------------------------------------


async def test_a_server_may_reject_a_goal_with_a_reason_before_it_runs(rig: Rig) -> None:
    class Careful(Counter):
        @COUNT.accepts
        def check(self, goal: Fibonacci.Goal) -> None:
            if goal.order < 0:
                raise Reject(f"order must not be negative, got {goal.order}")

    await rig.start(Careful)
    with pytest.raises(GoalRejected, match="/count rejected the goal: order must not be negative, got -1") as caught:
        async with rig.me.send_goal(COUNT, order(-1)):
            raise AssertionError("the block must not be entered")
    assert caught.value.reason == "order must not be negative, got -1"
    assert rig.node(Careful).log_of == []
    async with rig.me.send_goal(COUNT, order(1)) as goal:
        assert await goal == result(1)


async def test_an_acceptance_check_may_take_its_time_and_one_that_fails_rejects(rig: Rig) -> None:
    class Slow(Counter):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            await self.clock.sleep(1.0)
            if goal.order == 13:
                raise LookupError("no such number")

    await rig.start(Slow)
    with pytest.raises(GoalRejected, match="the acceptance check failed: LookupError: no such number"):
        await rig.send_goal(COUNT, order(13))
    goal = await rig.send_goal(COUNT, order(1))
    assert rig.now == 2.0
    assert await goal == result(1)


async def test_an_acceptance_check_that_returns_a_bool_is_told_to_raise_reject(rig: Rig) -> None:
    class Truthful(Counter):
        @COUNT.accepts
        def check(self, goal: Fibonacci.Goal) -> Any:
            return goal.order >= 0

    await rig.start(Truthful)
    said = (
        "the acceptance check failed: TypeError: @.*count.*accepts returned True: return None to accept, raise Reject"
    )
    with pytest.raises(GoalRejected, match=said):
        await rig.send_goal(COUNT, order(1))


async def test_an_async_acceptance_check_that_returns_false_accepts_no_goal(rig: Rig) -> None:
    class Truthful(Counter):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> Any:
            return goal.order >= 0

    await rig.start(Truthful)
    with pytest.raises(GoalRejected, match="accepts returned False: return None to accept, raise Reject"):
        await rig.send_goal(COUNT, order(-1))
    assert rig.node(Truthful).log_of == []


async def test_a_server_may_refuse_to_cancel(rig: Rig) -> None:
    class Stubborn(Counter):
        @COUNT.cancels
        def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            return goal.order != 2

    await rig.start(Stubborn)
    async with rig.me.send_goal(COUNT, order(2)) as goal:
        assert await goal.cancel() is False
        assert await goal == result(1, 2)
    async with rig.me.send_goal(COUNT, order(3)) as goal:
        assert await goal.cancel() is True
        with pytest.raises(GoalCanceled):
            await goal


async def test_leaving_the_block_of_a_goal_that_may_not_be_canceled_lets_it_run_on(rig: Rig) -> None:
    class Stubborn(Counter):
        @COUNT.cancels
        async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            return False

    await rig.start(Stubborn)
    async with rig.me.send_goal(COUNT, order(2)) as goal:
        pass
    assert rig.now == 0.0
    assert await goal == result(1, 2)


async def test_the_cancel_check_waits_for_its_nodes_turn(rig: Rig) -> None:
    class Busy(Counter):
        inside = 0
        overlapped = False

        @ADD.serve()
        async def add(self, request: Any) -> Any:
            self.inside += 1
            await self.clock.sleep(1.0)
            self.inside -= 1
            return total(0)

        @COUNT.cancels
        async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            self.overlapped = self.inside > 0
            return True

    await rig.start(Busy)
    goal = await rig.send_goal(COUNT, order(9))
    call = asyncio.create_task(rig.call(ADD, two(0, 0), timeout=2.0))
    await rig.quiet()
    assert await goal.cancel() is True
    assert rig.now == 1.0
    await call
    assert not rig.node(Busy).overlapped


async def test_a_cancel_check_that_fails_refuses_and_is_logged(rig: Rig) -> None:
    class Broken(Counter):
        @COUNT.cancels
        def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            raise LookupError("no idea")

    await rig.start(Broken)
    goal = await rig.send_goal(COUNT, order(1))
    assert await goal.cancel() is False
    assert await goal == result(1)
    (line,) = events(rig.logs, "cancel check failed")
    assert (line.fields["handler"], line.fields["error"]) == ("Broken.count (cancel check)", "LookupError: no idea")
    assert line.fields["at"].endswith("Broken.may_cancel")


@pytest.mark.parametrize("waits", [False, True])
@pytest.mark.parametrize(
    ("verdict", "agreed"),
    [(np.True_, True), (np.False_, False), (np.array([3, 4]).max() > 2, True), (None, None), (1, None), ("no", None)],
)
async def test_a_cancel_check_answers_with_a_bool_or_hears_how(
    rig: Rig, verdict: Any, agreed: bool | None, waits: bool
) -> None:
    def at_once(self: Node, goal: Fibonacci.Goal) -> Any:
        return verdict

    async def later(self: Node, goal: Fibonacci.Goal) -> Any:
        return verdict

    class Asked(Counter):
        may_cancel = COUNT.cancels(later if waits else at_once)

    await rig.start(Asked)
    goal = await rig.send_goal(COUNT, order(2))
    assert await goal.cancel() is bool(agreed)
    if agreed is None:
        (line,) = events(rig.logs, "cancel check failed")
        assert "cancels returned" in line.fields["error"]
        assert "return True to let the goal be canceled, False to refuse" in line.fields["error"]
        assert line.fields.get("at") != ""
    else:
        assert events(rig.logs, "cancel check failed") == []


async def test_a_node_that_cancels_its_own_goal_has_its_turn_already(rig: Rig) -> None:
    class Owner(Counter):
        canceled = False

        async def on_start(self) -> None:
            self.create_task(self.begin())

        async def begin(self) -> None:
            self.goal = self.send_goal(COUNT, order(9))
            await self.goal.send()

        @COUNT.cancels
        def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            return True

        @ADD.serve()
        async def add(self, request: Any) -> Any:
            self.canceled = await self.goal.cancel()
            return total(0)

    await rig.start(Owner)
    await rig.advance(0.5)
    await rig.call(ADD, two(0, 0))
    assert rig.node(Owner).canceled


async def test_a_cancel_check_that_its_node_does_not_live_to_answer_is_a_no(rig: Rig) -> None:
    class Dying(Counter):
        @COUNT.cancels
        async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            await self.clock.sleep(60.0)
            return True

    await rig.start(Child(Dying, stop="kill", restart=temporary))
    goal = await rig.send_goal(COUNT, order(99))
    asking = asyncio.create_task(goal.cancel())
    await rig.advance(1.0)
    await rig.system.supervisor.terminate_child("dying")  # type: ignore[union-attr]
    assert await asking is False
    assert (await goal.ended()).status is GoalStatus.ABORTED


async def test_a_goal_of_the_wrong_type_is_refused_where_it_is_made(rig: Rig) -> None:
    await rig.start(Counter)
    with pytest.raises(WrongType, match="/count takes Fibonacci_Goal, not Fibonacci_Result "):
        rig.me.send_goal(COUNT, result(1))  # type: ignore[misc]


async def test_an_action_that_nobody_serves_is_unavailable(rig: Rig) -> None:
    await rig.start(Node)
    with pytest.raises(ActionUnavailable, match="nobody accepted or rejected a goal of /count within 5 s"):
        await rig.send_goal(COUNT, order(1))
    assert rig.now == 5.0


async def test_a_goal_waits_for_its_server_to_appear(rig: Rig) -> None:
    await rig.start(Node)
    starting = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await rig.advance(2.0)
    await rig.system.supervisor.start_child(Child(Counter))  # type: ignore[union-attr]
    assert await (await starting) == result(1)


async def test_a_goal_for_a_server_that_restarts_or_has_stopped_fails_at_once(rig: Rig) -> None:
    await rig.start(Child(Counter, restart=transient, backoff=Backoff(1.0, 1.0)))
    rig.crash(Counter)
    await rig.quiet()
    with pytest.raises(NodeRestarting):
        await rig.send_goal(COUNT, order(1))
    await rig.settled()
    rig.node(Counter).stop()
    await rig.settled()
    with pytest.raises(
        NotRunning, match="/counter, which served /count, has stopped: start it again, or ask another action"
    ):
        await rig.send_goal(COUNT, order(1))


async def test_a_client_that_sends_goals_to_a_restarting_server_again_and_again_lets_the_others_run(rig: Rig) -> None:
    await rig.start(Child(Counter, restart=transient, backoff=Backoff(1.0, 1.0)))
    rig.crash(Counter)
    await rig.quiet()
    others: list[str] = []
    asyncio.get_running_loop().call_soon(others.append, "signals, timers, messages")
    for _ in range(1000):
        with pytest.raises(NodeRestarting):
            await rig.send_goal(COUNT, order(1))
        if others:
            break
    assert others and rig.now == 0.0


async def test_what_has_not_been_sent_cannot_be_used(rig: Rig) -> None:
    await rig.start(Counter)
    handle: Handle = rig.me.send_goal(COUNT, order(1))
    with pytest.raises(NotStarted, match="there is nothing to cancel"):
        await handle.cancel()
    for use in (handle.ended, handle.__anext__):
        with pytest.raises(NotStarted, match="enter it with `async with` first"):
            await use()
    await handle.send()
    with pytest.raises(RuntimeError, match="has been sent already: start another goal"):
        await handle.send()


async def test_a_second_server_of_an_action_is_refused(rig: Rig) -> None:
    with pytest.raises(
        StartFailed, match="/two would be the second server of action /count, which /one serves already"
    ):
        await rig.start(Child(Counter, name="one"), Child(Counter, name="two"))


async def test_a_goal_of_another_type_than_is_served_is_refused_with_both_types(rig: Rig) -> None:
    await rig.start(Counter)
    look_up = Action(LookupTransform, "count")
    with pytest.raises(
        WrongType,
        match=r"/count is served by /counter as example_interfaces/action/Fibonacci, and asked by .* as tf2_msgs/action/LookupTransform",
    ):
        await rig.send_goal(look_up, LookupTransform.Goal())


# -- cancellation ----------------------------------------------------------------------------------------------------


async def test_a_cancel_takes_effect_at_the_await_and_no_feedback_follows(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(10))
    await rig.advance(3.5)
    assert await goal.cancel() is True
    await rig.quiet()
    assert rig.now == 3.5
    assert goal.status is GoalStatus.CANCELED
    assert goal.feedback_count == 3
    await rig.advance(10.0)
    assert goal.feedback_count == 3
    assert rig.node(Counter).log_of == [(0.0, "begin 10"), (3.5, "end 10")]
    with pytest.raises(GoalCanceled, match="/count: goal canceled: canceled by its client") as caught:
        await goal
    assert (caught.value.reason, caught.value.result) == ("canceled by its client", None)


async def test_a_finished_goal_cannot_be_canceled(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(1))
    await goal
    assert await goal.cancel() is False
    assert goal.status is GoalStatus.SUCCEEDED


async def test_a_second_cancel_changes_nothing(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(10.0)
        finally:
            await self.clock.sleep(1.0)
        yield Done(result())

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.quiet()
    assert await goal.cancel("first") is True
    await rig.advance(0.5)
    assert await goal.cancel("second") is True
    await rig.advance(0.5)
    assert (await goal.ended()).reason == "first"
    assert rig.now == 1.0
    assert await goal.cancel("third") is False


async def test_a_cancel_belongs_to_its_goal(rig: Rig) -> None:
    await rig.start(serving(Counter.count, "queue", note=lambda self, what: None))
    first, second, third = [await rig.send_goal(COUNT, order(2)) for _ in range(3)]
    assert await third.cancel() is True
    assert third.status is GoalStatus.CANCELED  # it had not begun
    assert await first.cancel() is True
    assert await second == result(1, 2)
    assert await first.cancel() is False
    fourth = await rig.send_goal(COUNT, order(1))
    assert await fourth == result(1)


async def test_a_goal_that_reached_its_end_in_the_instant_of_the_cancel_has_one_outcome(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(1))
    await rig.system.clock.sleep_until(1.0)  # the body's sleep, scheduled before, has ended in this instant
    canceled = await goal.cancel()
    outcome = await goal.ended()
    assert (canceled, outcome.status) in ((True, GoalStatus.CANCELED), (False, GoalStatus.SUCCEEDED))
    assert (await goal.ended()) is outcome


async def test_a_cancel_after_the_last_word_comes_too_late(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        yield Done(result(42))
        await self.clock.sleep(1.0)  # putting things in order

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(0.5)
    assert goal.status is GoalStatus.EXECUTING
    assert await goal.cancel() is False
    assert await goal == result(42)
    assert rig.now == 1.0


async def test_a_goal_canceled_in_the_very_moment_of_its_acceptance_is_canceled_and_blocks_nobody(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(1))
    running = next(iter(server_of(rig).running))
    assert running.body is None  # its task has not come to its first step
    assert await goal.cancel() is True
    assert (await goal.ended()).status is GoalStatus.CANCELED
    assert rig.node(Counter).log_of == []
    assert await (await rig.send_goal(COUNT, order(2))) == result(1, 2)


async def test_leaving_the_block_cancels_and_waits_for_the_clean_up(rig: Rig) -> None:
    await rig.start(Counter)
    async with rig.me.send_goal(COUNT, order(10)) as goal:
        await rig.advance(2.5)
    assert goal.status is GoalStatus.CANCELED
    assert (await goal.ended()).reason == "its client left the goal's block"


async def test_a_client_that_is_canceled_takes_its_goal_with_it(rig: Rig) -> None:
    await rig.start(Counter)
    goals: list[Handle] = []

    async def client() -> None:
        async with rig.me.send_goal(COUNT, order(10)) as goal:
            goals.append(goal)
            await goal

    task = asyncio.create_task(client())
    await rig.advance(2.5)
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    assert goals[0].status is GoalStatus.CANCELED


async def test_a_client_without_a_block_that_disappears_leaves_its_goal_running(rig: Rig) -> None:
    await rig.start(Counter)

    async def client() -> None:
        goal = rig.me.send_goal(COUNT, order(3))
        await goal.send()
        await goal

    task = asyncio.create_task(client())
    await rig.advance(0.5)
    task.cancel()
    await rig.advance(3.0)
    assert rig.node(Counter).log_of[-1] == (3.0, "end 3")


async def test_leaving_the_block_waits_five_seconds_for_a_clean_up_and_no_longer(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(100.0)
        finally:
            await self.clock.sleep(8.0)
        yield Done(result())

    await rig.start(serving(body))
    async with rig.me.send_goal(COUNT, order(1)) as goal:
        await rig.quiet()
    assert rig.now == 5.0
    assert goal.status is GoalStatus.CANCELING
    assert (await goal.ended()).status is GoalStatus.CANCELED
    assert rig.now == 8.0


async def test_a_client_that_is_canceled_while_its_goal_is_considered_leaves_nothing_behind(rig: Rig) -> None:
    class Slow(Counter):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            await self.clock.sleep(1.0)

    await rig.start(Slow)
    early = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    late = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await rig.advance(0.5)
    early.cancel()
    late.cancel()
    await rig.advance(5.0)
    assert rig.node(Slow).log_of == []
    assert not server_of(rig).requests


async def test_a_client_that_goes_while_its_goal_is_considered_preempts_nobody(rig: Rig) -> None:
    class Slow(Node):
        async def check(self, goal: Fibonacci.Goal) -> None:
            if goal.order == 1:
                await self.clock.sleep(1.0)

    await rig.start(serving(Counter.count, "preempt", note=lambda self, what: None, check=COUNT.accepts(Slow.check)))
    first = await rig.send_goal(COUNT, order(5))
    second = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await rig.advance(0.5)
    second.cancel()
    assert await first == result(1, 2, 3, 4, 5)


async def test_a_client_that_is_canceled_in_the_moment_of_acceptance_cancels_its_goal(rig: Rig) -> None:
    await rig.start(Counter)
    starting = asyncio.create_task(rig.send_goal(COUNT, order(5)))
    await asyncio.sleep(0)
    server = server_of(rig)
    (request,) = server.requests
    rig.state(Counter).inbox.put_control(Moment(starting.cancel))  # before the client can look at the answer
    await rig.advance(10.0)
    assert starting.cancelled()
    assert server.table.status_of(request.goal_id) is GoalStatus.CANCELED


async def test_a_client_that_is_canceled_in_the_moment_of_rejection_just_ends(rig: Rig) -> None:
    await rig.start(Counter)
    await rig.send_goal(COUNT, order(5))
    starting = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await asyncio.sleep(0)
    rig.state(Counter).inbox.put_control(Moment(starting.cancel))
    await rig.quiet()
    assert starting.cancelled()


# -- how a body may end (the table of the driver) --------------------------------------------------------------------


async def ended(rig: Rig, body: Callable[[Node, Fibonacci.Goal], Body], *, cancel_at: float | None = None) -> Any:
    """The outcome of one goal of order 1 served by `body`."""
    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    if cancel_at is not None:
        await rig.advance(cancel_at)
        assert await goal.cancel() is True
    return await goal.ended()


async def test_D2_the_bodys_own_timeout_fires_inside_it(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        with anyio.fail_after(1.0):
            yield step(1)
            await self.clock.sleep(5.0)
        yield Done(result())

    outcome = await ended(rig, body)
    assert rig.now == 1.0
    assert (outcome.status, outcome.reason) == (GoalStatus.ABORTED, "TimeoutError: ")


@pytest.mark.parametrize("scope", [asyncio.timeout, anyio.fail_after])
async def test_D2_a_timeout_that_fires_between_two_steps_is_the_bodys(rig: Rig, scope: Callable[[float], Any]) -> None:
    """The driver's turn of the loop after a feedback is the only place between steps; the deadline is put into it."""

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            context = scope(1.0)
            if scope is asyncio.timeout:
                async with context:
                    await self.clock.sleep_until(1.0)
                    yield step(1)
                    await self.clock.sleep(5.0)
            else:
                with context:
                    await self.clock.sleep_until(1.0)
                    yield step(1)
                    await self.clock.sleep(5.0)
        except TimeoutError:
            yield step(2)
        await self.clock.sleep(1.0)
        yield Done(result(7))

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    assert await goal == result(7)
    assert rig.now == 2.0
    assert [list(feedback.sequence) async for feedback in goal][-1] == [2]


async def test_D2_a_cancel_between_two_steps_lets_a_shielded_clean_up_complete(rig: Rig) -> None:
    cleaned: list[float] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            yield step(1)
            yield step(2)
            await self.clock.sleep(60.0)
        finally:
            with anyio.CancelScope(shield=True):
                await self.clock.sleep(0.5)
                cleaned.append(self.clock.now())

    await rig.start(serving(body))
    async with rig.me.send_goal(COUNT, order(1)) as goal:
        await goal.__anext__()  # the driver is between two steps
        assert goal.feedback_count == 1
    assert goal.status is GoalStatus.CANCELED
    assert cleaned == [0.5]


@pytest.mark.parametrize("inside", [True, False])
async def test_D2_a_failing_child_of_the_bodys_task_group_is_the_bodys_to_handle(rig: Rig, inside: bool) -> None:
    async def fail_soon(node: Node) -> None:
        await node.clock.sleep(1.0)
        raise LookupError("child")

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        caught = 0
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(fail_soon, self)
                while True:
                    if inside:
                        await self.clock.sleep(10.0)
                    await self.clock.sleep(0.25)
                    yield step(1)
        except* LookupError:
            caught = 1
        yield Done(result(caught))

    outcome = await ended(rig, body)
    assert (outcome.status, outcome.result) == (GoalStatus.SUCCEEDED, result(1))
    assert rig.now == 1.0


async def test_D2_done_inside_a_scope_is_resumed_to_the_end_not_closed_inside_it(rig: Rig) -> None:
    after: list[str] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(self.clock.sleep, 0.5)
                yield Done(result(1))
                after.append("after Done")
            after.append("after the group")
        finally:
            after.append("finally")

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.SUCCEEDED
    assert after == ["after Done", "after the group", "finally"]
    assert rig.now == 0.5


async def test_D2_a_body_that_swallows_cancellations_is_closed_and_reported(rig: Rig) -> None:
    class Deaf(Node):
        swallowed = 0

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Body:
            while True:
                try:
                    await self.clock.sleep(1.0)
                    yield step(1)
                except asyncio.CancelledError:
                    self.swallowed += 1

    await rig.start(Deaf)
    goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(0.5)
    await goal.cancel()
    outcome = await goal.ended()
    assert outcome.status is GoalStatus.ABORTED
    assert outcome.reason.startswith("RuntimeError: Deaf.count went on after 3 errors thrown into it; it was closed.")
    assert rig.node(Deaf).swallowed == 4  # the interruption, and three more
    assert len(events(rig.logs, "goal failed")) == 1
    assert rig.incarnation(Deaf) == 1


async def test_D2_a_body_that_is_closed_has_cleaned_up_before_its_goal_has_ended(rig: Rig) -> None:
    cleaned: list[float] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            while True:
                try:
                    yield "feedback"  # type: ignore[misc]
                except WrongType:
                    pass
        finally:
            await self.clock.sleep(2.0)
            cleaned.append(self.clock.now())

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.ABORTED
    assert cleaned == [rig.now] == [2.0]


async def test_D2_a_second_item_after_done_is_an_error_at_that_yield(rig: Rig) -> None:
    heard: list[str] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        yield Done(result(1))
        try:
            yield step(2)
        except RuntimeError as error:
            heard.append(str(error))
            raise

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.ABORTED
    assert outcome.result == result(1)
    assert heard[0].startswith("Server.count yielded again after its last item Done(")


async def test_D2_a_body_that_insists_on_wrong_items_is_closed_and_blocks_nobody(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        while True:
            try:
                yield "feedback"  # type: ignore[misc]
            except WrongType:
                pass

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.ABORTED
    assert "Server.count went on after 3 errors" in outcome.reason
    assert "WrongType: Server.count yields Fibonacci_Feedback, Done or Aborted, not str 'feedback'" in outcome.reason


async def test_D2_a_canceled_body_that_goes_on_is_canceled_again_after_a_thousand_feedbacks(rig: Rig) -> None:
    taken: list[int] = []
    why: list[str] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        for value in range(3):  # before the cancel request, so they do not count
            yield step(value)
        try:
            await self.clock.sleep(60.0)
        except asyncio.CancelledError:
            for _ in range(2):
                taken.append(0)
                try:
                    for value in range(1500):
                        yield step(value)
                        taken[-1] += 1
                except asyncio.CancelledError as error:
                    why.append(str(error))
            raise

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(10.0)
    await goal.cancel("enough")
    with pytest.raises(GoalCanceled):
        await goal
    assert (taken, why) == ([1000, 1000], ["enough", "enough"])
    assert (rig.now, goal.feedback_count) == (10.0, 2003)


async def test_a_canceled_body_that_the_framework_unwinds_is_aborted_with_its_node(rig: Rig) -> None:
    class Death(NodeExit):
        """What ends a node at once, as in a simulation that loses its power."""

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(60.0)
        except asyncio.CancelledError:
            raise Death from None
        yield Done(result())

    rig.expect_failure(Death)
    outcome = await ended(rig, body, cancel_at=1.0)
    assert (outcome.status, outcome.reason) == (GoalStatus.ABORTED, "/server ended while the goal ran")
    await rig.settled()
    assert rig.incarnation("server") == 2


async def test_D2_a_canceled_body_may_hand_over_what_it_has(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(60.0)
        except asyncio.CancelledError:
            await self.clock.sleep(0.5)
            yield Done(result(1, 2))

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(1.0)
    await goal.cancel()
    with pytest.raises(GoalCanceled) as caught:
        await goal
    assert caught.value.result == result(1, 2)
    assert rig.now == 1.5


async def test_D3_aborted_hands_over_a_result_and_a_reason(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        yield Aborted(result(1), "the way is blocked")

    await rig.start(serving(body))
    goal = await rig.send_goal(COUNT, order(1))
    with pytest.raises(GoalAborted, match="/count: goal aborted: the way is blocked") as caught:
        await goal
    assert (caught.value.result, caught.value.reason) == (result(1), "the way is blocked")


async def test_D3_a_body_without_a_last_item_aborts_its_goal(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        yield step(1)

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.ABORTED
    assert outcome.reason == "its body ended without a result: end it with `yield Done(result)`"
    assert len(events(rig.logs, "an action body ended without Done or Aborted")) == 1


async def test_D3_a_body_that_swallows_its_cancellation_and_just_ends_aborts_its_goal(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(60.0)
            yield step(1)
        except asyncio.CancelledError:
            return

    outcome = await ended(rig, body, cancel_at=1.0)
    assert outcome.status is GoalStatus.ABORTED
    assert outcome.reason.startswith("canceled by its client, but its body ended without a result")


async def test_an_exception_in_the_body_aborts_the_goal_and_a_retry_may_succeed(rig: Rig) -> None:
    class Moody(Node):
        attempts = 0

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Body:
            self.attempts += 1
            if self.attempts < 3:
                raise OSError("joint stuck")
            yield Done(result(self.attempts))

    await rig.start(Moody)
    for _ in range(2):
        with pytest.raises(GoalAborted, match="OSError: joint stuck"):
            await (await rig.send_goal(COUNT, order(1)))
    assert await (await rig.send_goal(COUNT, order(1))) == result(3)
    assert len(events(rig.logs, "goal failed")) == 2
    assert rig.incarnation(Moody) == 1


async def test_an_exception_in_a_clean_up_aborts_the_canceled_goal(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(60.0)
            yield step(1)
        finally:
            raise OSError("cannot park")

    outcome = await ended(rig, body, cancel_at=1.0)
    assert (outcome.status, outcome.reason) == (GoalStatus.ABORTED, "OSError: cannot park")


async def test_a_reject_out_of_the_body_aborts_the_goal_with_its_reason(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        raise Reject("too late to say no")
        yield

    outcome = await ended(rig, body)
    assert (outcome.status, outcome.reason) == (GoalStatus.ABORTED, "too late to say no")


async def test_a_result_of_the_wrong_type_is_an_error_at_that_yield_so_the_body_cleans_up(rig: Rig) -> None:
    where: list[str] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            yield Done(step(1))  # type: ignore[arg-type]
        except WrongType as error:
            where.append(str(error))
            yield Done(result(1))

    outcome = await ended(rig, body)
    assert outcome.result == result(1)
    assert where[0].startswith("Server.count ends with Fibonacci_Result, not Fibonacci_Feedback ")


async def test_a_body_that_awaits_something_canceled_aborts_its_goal_only(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        task = asyncio.ensure_future(asyncio.sleep(1.0))
        task.cancel()
        await task
        yield Done(result())

    outcome = await ended(rig, body)
    assert outcome.status is GoalStatus.ABORTED
    assert "awaited something that was canceled" in outcome.reason


async def test_on_error_may_let_a_failed_goal_end_its_node(rig: Rig) -> None:
    rig.expect_failure(OSError)
    asked: list[str] = []

    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        raise OSError("joint stuck")
        yield

    def verdict(self: Node, error: Exception, handler: str) -> str:
        asked.append(handler)
        return "fail"

    await rig.start(Child(serving(body, on_error=verdict), name="server"))
    goal = await rig.send_goal(COUNT, order(1))
    with pytest.raises(GoalAborted):
        await goal
    await rig.settled()
    assert rig.incarnation("server") == 2
    assert asked == ["Server.count"]


async def test_a_body_may_raise_Stop_to_end_its_node(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        raise Stop("the last goal is done")
        yield

    await rig.start(Child(serving(body), name="server", restart=transient))
    goal = await rig.send_goal(COUNT, order(1))
    assert (await goal.ended()).status is GoalStatus.ABORTED
    await rig.settled()
    assert rig.state("server").state == "stopped"


# -- arrivals --------------------------------------------------------------------------------------------------------


async def test_arrivals_reject_refuses_while_another_goal_runs(rig: Rig) -> None:
    await rig.start(Counter)
    first = await rig.send_goal(COUNT, order(2))
    with pytest.raises(GoalRejected, match="another goal is running"):
        await rig.send_goal(COUNT, order(1))
    await first
    assert await (await rig.send_goal(COUNT, order(1))) == result(1)


async def test_arrivals_preempt_cancels_cleans_up_then_starts(rig: Rig) -> None:
    class Driver(Node):
        def __init__(self) -> None:
            self.story: list[tuple[float, str]] = []

        @COUNT.serve(arrivals="preempt")
        async def count(self, goal: Fibonacci.Goal) -> Body:
            self.story.append((self.clock.now(), f"begin {goal.order}"))
            try:
                await self.clock.sleep(10.0)
            finally:
                with anyio.CancelScope(shield=True):
                    await self.clock.sleep(0.5)
                self.story.append((self.clock.now(), f"end {goal.order}"))
            yield Done(result(goal.order))

    await rig.start(Driver)
    first = await rig.send_goal(COUNT, order(1))
    await rig.advance(1.0)
    second = await rig.send_goal(COUNT, order(2))
    assert (first.status, second.status) == (GoalStatus.CANCELING, GoalStatus.ACCEPTED)
    third = await rig.send_goal(COUNT, order(3))
    assert second.status is GoalStatus.CANCELED  # it never ran
    assert await third == result(3)
    for goal in (first, second):
        with pytest.raises(GoalCanceled, match="preempted by a newer goal"):
            await goal
    assert rig.node(Driver).story == [(0.0, "begin 1"), (1.5, "end 1"), (1.5, "begin 3"), (12.0, "end 3")]


async def test_goals_that_arrive_together_preempt_each_other_and_the_last_one_runs(rig: Rig) -> None:
    await rig.start(serving(Counter.count, "preempt", note=lambda self, what: None))
    goals = await asyncio.gather(*(rig.send_goal(COUNT, order(index)) for index in (3, 2, 1)))
    outcomes = [await goal.ended() for goal in goals]
    assert [outcome.status for outcome in outcomes] == [GoalStatus.CANCELED, GoalStatus.CANCELED, GoalStatus.SUCCEEDED]
    assert rig.now == 1.0


async def test_arrivals_queue_runs_one_after_another_and_rejects_beyond_its_size(rig: Rig) -> None:
    await rig.start(serving(Counter.count, queue(2), note=lambda self, what: None))
    goals = [await rig.send_goal(COUNT, order(index)) for index in (1, 2, 3)]
    with pytest.raises(GoalRejected, match="the queue is full: 2 goals wait"):
        await rig.send_goal(COUNT, order(4))
    ends: list[float] = []
    for goal in goals:
        await goal
        ends.append(rig.now)
    assert ends == [1.0, 3.0, 6.0]


async def test_arrivals_parallel_runs_at_once_and_rejects_beyond_its_size(rig: Rig) -> None:
    await rig.start(serving(Counter.count, parallel(2), note=lambda self, what: None))
    goals = [await rig.send_goal(COUNT, order(2)) for _ in range(2)]
    with pytest.raises(GoalRejected, match="2 goals run already"):
        await rig.send_goal(COUNT, order(1))
    assert [await goal for goal in goals] == [result(1, 2)] * 2
    assert rig.now == 2.0


# -- the end of the server's node ------------------------------------------------------------------------------------


async def test_a_restart_of_the_server_aborts_its_goals_after_their_clean_up(rig: Rig) -> None:
    await rig.start(Child(serving(Counter.count, queue(5), note=lambda self, what: None), name="server"))
    running, waiting = await rig.send_goal(COUNT, order(9)), await rig.send_goal(COUNT, order(9))
    await rig.advance(1.5)
    rig.crash("server")
    await rig.settled()
    for goal in (running, waiting):
        with pytest.raises(GoalAborted, match="/server stops: it raised RuntimeError: crashed by the rig"):
            await goal
    assert await (await rig.send_goal(COUNT, order(1))) == result(1)


async def test_a_stop_of_the_server_aborts_its_goals_and_keeps_what_they_hand_over(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        try:
            await self.clock.sleep(60.0)
            yield step(1)
        except asyncio.CancelledError:
            yield Done(result(5))

    await rig.start(Child(serving(body), name="server", restart=temporary))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(1.0)
    await rig.system.supervisor.terminate_child("server")  # type: ignore[union-attr]
    with pytest.raises(GoalAborted, match="/server stops: it stopped: ") as caught:
        await goal
    assert caught.value.result == result(5)


async def test_a_stop_leaves_the_outcome_of_a_goal_that_was_canceled_or_had_its_last_word(rig: Rig) -> None:
    async def body(self: Node, goal: Fibonacci.Goal) -> Body:
        if goal.order == 1:
            yield Done(result(1))
        try:
            await self.clock.sleep(60.0)
        finally:
            await self.clock.sleep(1.0)

    await rig.start(Child(serving(body, "parallel"), name="server"))
    finishing, canceled = await rig.send_goal(COUNT, order(1)), await rig.send_goal(COUNT, order(2))
    await rig.advance(1.0)
    await canceled.cancel("not needed")
    await rig.advance(0.5)
    rig.crash("server")
    await rig.settled()
    assert await finishing == result(1)
    assert repr(await canceled.ended()) == "<CANCELED: not needed>"


async def test_a_server_that_is_killed_aborts_its_goals(rig: Rig) -> None:
    await rig.start(Child(Counter, stop="kill"))
    goal = await rig.send_goal(COUNT, order(9))
    await rig.quiet()
    arriving = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await asyncio.sleep(0)
    await rig.system.supervisor.terminate_child("counter")  # type: ignore[union-attr]
    with pytest.raises(GoalAborted, match="/counter"):
        await goal
    with pytest.raises((NodeRestarting, GoalRejected)):
        await arriving


class Sleepy(Node):
    """Sleeps in a handler, and serves an action."""

    @NUMBERS.on()
    async def sleep(self, message: Int32) -> None:
        await self.clock.sleep(60.0)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result(goal.order))


async def test_a_goal_that_a_busy_node_does_not_answer_says_with_what_it_is_busy(rig: Rig) -> None:
    await rig.start(Sleepy)
    rig.publish(NUMBERS, number(1))
    await rig.advance(0.1)
    with pytest.raises(
        ActionUnavailable,
        match=r"/sleepy, which serves /count, neither accepted nor rejected the goal within 5 s: it is busy with Sleepy.sleep; "
        "declare a handler that waits concurrent=n, or give the goal more time",
    ):
        await rig.send_goal(COUNT, order(1))


async def test_a_goal_that_a_node_does_not_answer_while_it_starts_says_so(rig: Rig) -> None:
    class Slow(Sleepy):
        async def on_start(self) -> None:
            await self.clock.sleep(60.0)

    await rig.start(Node)
    assert rig.system.supervisor is not None
    starting = asyncio.ensure_future(rig.system.supervisor.start_child(Child(Slow)))
    await rig.advance(0.1)
    with pytest.raises(ActionUnavailable, match=r"/slow, which serves /count, neither .* it is not ready"):
        await rig.send_goal(COUNT, order(1))
    starting.cancel()
