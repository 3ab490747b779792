"""Actions: goals with ten feedbacks each, one after another; how many get lost, and whether the last goals are as fast as the first.

There is no peer in Python with goals, feedback and cancellation but rclpy, which needs
an installation of ROS. The floor is a task that puts ten feedbacks into a deque, one in each turn of the loop, and a result into a
future.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import TypeAlias

from actors import Action, Child, Done, Node, Steps, Supervisor
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks._peers import clock, living, node_of, on_loop

COUNT = Action(Fibonacci, "count")
FEEDBACKS = 10
GOAL = Fibonacci.Goal(order=FEEDBACKS)
GOALS = 600
"""Of each round; a multiple of four."""

Figures: TypeAlias = tuple[float, float, float]


def run() -> list[Row]:
    contestants = [
        Contestant("node to node", "ours", _nodes),
        Contestant("task, deque and future", "floor", lambda: on_loop(_bare)),
        Contestant("task and asyncio.Queue", "peer", lambda: on_loop(_queue)),
    ]
    units = ["goals per CPU second", "feedbacks lost", "last quarter's rate over the first's"]
    return contest(f"action with {FEEDBACKS} feedbacks", units, contestants)


async def _drive(goal: Callable[[], Awaitable[int]]) -> Figures:
    """Goals one after another; each says how many feedbacks it got."""
    got = 0
    times = [clock()]
    for _ in range(4):
        for _ in range(GOALS // 4):
            got += await goal()
        times.append(clock())
    return GOALS / (times[4] - times[0]), GOALS * FEEDBACKS - got, (times[1] - times[0]) / (times[4] - times[3])


class _Counter(Node):
    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for number in range(goal.order):
            yield Fibonacci.Feedback(sequence=(number,))
        yield Done(Fibonacci.Result(sequence=(goal.order,)))


class _Client(Node):
    async def ask(self) -> int:
        got = 0
        async with self.send_goal(COUNT, GOAL) as goal:
            async for _ in goal:
                got += 1
            assert (await goal).sequence[0] == FEEDBACKS
        return got


def _nodes() -> Figures:
    async def main() -> Figures:
        tree = Supervisor("actions", children=[Child(_Counter, name="counter"), Child(_Client, name="client")])
        async with living(tree) as system:
            return await _drive(node_of(system, _Client, "/client").ask)

    return on_loop(main)


async def _bare() -> Figures:
    loop = asyncio.get_running_loop()

    async def goal() -> int:
        feedbacks: deque[Fibonacci.Feedback] = deque()
        ended: asyncio.Future[Fibonacci.Result] = loop.create_future()
        changed: asyncio.Future[None] = loop.create_future()

        async def work() -> None:
            for number in range(FEEDBACKS):
                feedbacks.append(Fibonacci.Feedback(sequence=(number,)))
                if not changed.done():
                    changed.set_result(None)
                await asyncio.sleep(0)
            ended.set_result(Fibonacci.Result(sequence=(FEEDBACKS,)))
            if not changed.done():
                changed.set_result(None)

        task = asyncio.ensure_future(work())
        got = 0
        while not ended.done():
            await changed
            changed = loop.create_future()
            while feedbacks:
                feedbacks.popleft()
                got += 1
        assert (await ended).sequence[0] == FEEDBACKS
        await task
        return got

    return await _drive(goal)


async def _queue() -> Figures:
    async def goal() -> int:
        items: asyncio.Queue[Fibonacci.Feedback | Fibonacci.Result] = asyncio.Queue()

        async def work() -> None:
            for number in range(FEEDBACKS):
                items.put_nowait(Fibonacci.Feedback(sequence=(number,)))
                await asyncio.sleep(0)
            items.put_nowait(Fibonacci.Result(sequence=(FEEDBACKS,)))

        task = asyncio.ensure_future(work())
        got = 0
        while isinstance(await items.get(), Fibonacci.Feedback):
            got += 1
        await task
        return got

    return await _drive(goal)
