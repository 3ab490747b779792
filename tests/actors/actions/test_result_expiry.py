"""Results of goals are dropped when their time is over, on the clock of their server, whether or not another goal comes."""

from __future__ import annotations

import asyncio
import gc

import pytest

from actors import Action, Child, Done, Node, Steps, Topic
from actors.actions.server import ActionServer
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.runtime.incarnation import incarnation_of
from actors.testing import Rig

COUNT = Action(Fibonacci, "count")
CLOCK = Topic(Clock, "/clock")


class Counter(Node):
    """Counts at once; its results are kept for 10 s."""

    @COUNT.serve(arrivals="queue")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.clock.sleep(0.0)
        yield Done(Fibonacci.Result(sequence=[goal.order]))


def server_of(rig: Rig) -> ActionServer:
    return incarnation_of(rig.node(Counter)).record.actions["/count"]


async def run_goal(rig: Rig, order: int = 1) -> None:
    async with rig.me.send_goal(COUNT, Fibonacci.Goal(order=order)) as goal:
        assert (await goal).sequence.tolist() == [order]


def timers_for(server: ActionServer) -> int:
    """How many timers of the loop are there for this server."""
    loop = asyncio.get_running_loop()
    entries = loop._timers  # type: ignore[attr-defined]
    waiting = [entry[3] for entry in entries if not entry[3].cancelled()]
    return sum(getattr(getattr(item, "_callback", None), "__self__", None) is server for item in waiting)


async def test_a_result_is_dropped_when_its_time_is_over(rig: Rig) -> None:
    await rig.start(Counter)
    server = server_of(rig)
    assert timers_for(server) == 0
    await run_goal(rig)
    await rig.advance(9.9)
    assert len(server.table) == 1
    await rig.advance(0.2)
    assert len(server.table) == 0
    assert timers_for(server) == 0


async def test_many_results_share_one_timer_and_go_at_most_a_tenth_of_their_time_late(rig: Rig) -> None:
    await rig.start(Counter)
    server = server_of(rig)
    for order in range(100):
        await run_goal(rig, order)
        await rig.advance(0.1)
        assert timers_for(server) == 1
    assert len(server.table) == 100
    for second in range(1, 11):
        await rig.advance(1.0)
        kept = len(server.table)
        assert 100 - 10 * second <= kept <= 100 - 10 * (second - 1)
        assert timers_for(server) == (kept > 0)
    await rig.advance(1.0)
    assert len(server.table) == 0


@pytest.mark.parametrize(("timeout", "kept"), [(0.0, 0), (-1.0, 1), (100.0, 1)])
async def test_results_may_be_dropped_at_once_or_kept_forever(rig: Rig, timeout: float, kept: int) -> None:
    class Other(Node):
        """Its results have another time."""

        @COUNT.serve(result_timeout=timeout)
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(Fibonacci.Result())

    await rig.start(Other)
    async with rig.me.send_goal(COUNT, Fibonacci.Goal()) as goal:
        await goal
    server = incarnation_of(rig.node(Other)).record.actions["/count"]
    await rig.advance(50.0)
    assert len(server.table) == kept
    assert timers_for(server) == (timeout == 100.0)


async def test_nothing_waits_for_the_results_of_a_node_that_has_ended(rig: Rig) -> None:
    await rig.start(Child(Counter, restart="permanent"))
    server = server_of(rig)
    await run_goal(rig)
    assert timers_for(server) == 1
    rig.crash(Counter)
    await rig.settled()
    assert timers_for(server) == 0
    server._expire_now()  # a timer that had just fired
    assert timers_for(server) == 0


async def test_a_result_that_is_dropped_is_free_without_the_garbage_collector(rig: Rig) -> None:
    await rig.start(Counter)
    await run_goal(rig)
    gc.collect()
    gc.disable()
    try:
        before = {
            id(found) for found in gc.get_objects() if type(found).__name__ == "GoalRecord"
        }  # other tests' may live yet
        for order in range(20):
            await run_goal(rig, order)
        await rig.advance(30.0)
        left = [found for found in gc.get_objects() if type(found).__name__ == "GoalRecord" and id(found) not in before]
        assert len(left) <= 1  # the item that the inbox had last
    finally:
        gc.enable()


def at(seconds: int) -> Clock:
    return Clock(clock=Time(sec=seconds))


async def test_under_simulated_time_a_result_waits_for_that_time(rig: Rig) -> None:
    await rig.start(Child(Counter, parameters={"use_sim_time": True}))
    server = server_of(rig)
    rig.publish(CLOCK, at(100))
    goal = await rig.send_goal(COUNT, Fibonacci.Goal(order=3))
    await rig.advance(1.0)
    rig.publish(CLOCK, at(101))
    assert (await goal).sequence.tolist() == [3]
    await rig.advance(60.0)  # time stands still
    assert len(server.table) == 1
    assert timers_for(server) == 0
    rig.publish(CLOCK, at(105))
    await rig.advance(1.0)
    assert len(server.table) == 1
    rig.publish(CLOCK, at(112))
    await rig.advance(1.0)
    assert len(server.table) == 0


async def test_when_simulated_time_is_switched_off_the_results_go_on_the_system_s_clock(rig: Rig) -> None:
    await rig.start(Child(Counter, parameters={"use_sim_time": True}))
    server = server_of(rig)
    rig.publish(CLOCK, at(5))
    goal = await rig.send_goal(COUNT, Fibonacci.Goal(order=3))
    await rig.advance(1.0)
    rig.publish(CLOCK, at(6))
    await goal
    assert rig.node(Counter).set_parameter("use_sim_time", False).successful
    await rig.advance(30.0)
    assert len(server.table) == 0
    rig.node(Counter).set_parameter("use_sim_time", True)
    canceled = rig.node(Counter).clock.call_at(1e6, lambda: pytest.fail("it was canceled"))
    canceled.cancel()
    await rig.advance(1.0)
