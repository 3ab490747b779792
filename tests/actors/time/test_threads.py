"""Used from a thread that is not its event loop's, a node says so before anything is done, and names the way."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from actors import Child, Done, Node, Service, Steps, Supervisor, open_node, parameter, run
from actors.actions.goals import GoalStatus
from actors.errors import WrongThread
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.system import System
from tests.stage import ADD, COUNT, NUMBERS

NOBODY = Service(AddTwoInts, "nobody")
CONCURRENT = Service(AddTwoInts, "concurrent")


class Robot(Node):
    """What a foreign thread reaches for."""

    speed = parameter(1.0)

    @CONCURRENT.serve(concurrent=2)
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


class Adder(Node):
    """Answers."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


class Counter(Node):
    """Counts for long."""

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for number in range(goal.order):
            await self.clock.sleep(0.01)
            yield Fibonacci.Feedback(sequence=[number])
        yield Done(Fibonacci.Result())


def in_a_loop_of_its_own(work: Callable[[], Coroutine[Any, Any, object]]) -> object:
    async def both() -> object:
        return await work()

    return asyncio.run(both())


REMEDY = "used from a foreign thread: use node.threadsafe(function, *arguments), and for what is awaited blocking.open_node(name, system=system)"


async def test_a_foreign_thread_is_refused_before_anything_is_done() -> None:
    tree = Supervisor("s", children=[Child(Robot), Child(Adder), Child(Counter)])
    async with run(tree, sinks=(), signals=False) as system, open_node("me") as me, open_node("other") as other:
        robot = system.runtime.directory.find("/robot")
        assert robot is not None and system.supervisor is not None
        node, supervisor = robot.node, system.supervisor
        request = AddTwoInts.Request(a=1, b=2)
        await me.call(ADD, request)
        async with me.send_goal(COUNT, Fibonacci.Goal(order=1000)) as goal:
            unsent = me.send_goal(COUNT, Fibonacci.Goal(order=1))
            attempts: dict[str, Callable[[], object]] = {
                "set_parameter": lambda: node.set_parameter("speed", 2.0),
                "set_parameters": lambda: node.set_parameters({"speed": 2.0}),
                "checkpoint": lambda: node.checkpoint(1),
                "stop": node.stop,
                "subscribe": lambda: me.subscribe(NUMBERS),
                "call": lambda: in_a_loop_of_its_own(lambda: me.call(ADD, request)),
                "concurrent call": lambda: in_a_loop_of_its_own(lambda: me.call(CONCURRENT, request)),
                "call of nobody": lambda: in_a_loop_of_its_own(lambda: me.call(NOBODY, request, timeout=60.0)),
                "goal": lambda: in_a_loop_of_its_own(unsent.send),
                "cancel": lambda: in_a_loop_of_its_own(goal.cancel),
            }
            for name, attempt in attempts.items():
                with pytest.raises(WrongThread, match=r"^/(robot|me) was ") as refused:
                    await asyncio.to_thread(attempt)
                assert REMEDY in str(refused.value), name
            with pytest.raises(WrongThread, match="supervisor s was asked from a foreign event loop"):
                await asyncio.to_thread(in_a_loop_of_its_own, lambda: supervisor.start_child(Child(Node, name="late")))
            with pytest.raises(WrongThread, match=r"runs in another event loop: use blocking\.open_node\(name, system"):
                await asyncio.to_thread(in_a_loop_of_its_own, lambda: joined(system))
            assert goal.status is GoalStatus.EXECUTING
            assert unsent.status is GoalStatus.UNKNOWN
        assert (await me.call(ADD, request)).sum == 3
        # made in a foreign thread, awaited in the loop: that is what run_coroutine_threadsafe is for
        loop = asyncio.get_running_loop()
        answer = await asyncio.to_thread(
            lambda: asyncio.run_coroutine_threadsafe(other.call(CONCURRENT, request), loop).result(5.0)
        )
        assert answer.sum == 3
        adder = system.runtime.directory.find("/adder")
        assert adder is not None and adder.record.services["/add"].calls == 2
        assert node.speed == 1.0 and robot.record.saved is None and robot.record.services["/concurrent"].calls == 1  # type: ignore[attr-defined]
        assert sorted(state.identity.fqn for state in system.nodes.values()) == [
            "/adder",
            "/counter",
            "/me",
            "/other",
            "/robot",
        ]


async def joined(system: System) -> None:
    async with open_node("foreign", system=system):
        raise AssertionError("it has joined")
