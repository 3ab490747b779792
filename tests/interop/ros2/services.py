"""Services, actions, and what ROS 2's graph shows a process."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

from actors import Action, Done, GoalAborted, GoalCanceled, GoalRejected, Node, Reject, Service, Steps
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from tests.interop.parties import until
from tests.interop.ros2.bench import Bench, Check

COUNT = Action(Fibonacci, "/ours/fibonacci")
THEIR_COUNT = Action(Fibonacci, "/ros/fibonacci")
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


def numbers(order: int) -> list[int]:
    found = [0, 1]
    while len(found) <= order:
        found.append(found[-1] + found[-2])
    return found[: order + 1]


class Counter(Node):
    """Fibonacci's numbers, one each 50 ms."""

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order > 40:
            raise Reject("too many")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for order in range(2, goal.order + 1):
            await self.clock.sleep(0.05)
            yield Fibonacci.Feedback(sequence=numbers(order))
        if goal.order == 13:
            raise ValueError("thirteen")
        yield Done(Fibonacci.Result(sequence=numbers(goal.order)))


def checks() -> Iterator[tuple[str, Check]]:
    yield "their client, our service", their_client
    yield "their client, our service without request fields", their_client_of_trigger
    yield "our client, their service", our_client
    yield "twenty calls at once, each with its own answer", many_calls
    yield "their goal at our action server, with feedback", their_goal
    yield "their goal is rejected, aborted, canceled by us", their_goal_fails
    yield "our goal at their action server, with feedback", our_goal
    yield "our goal is rejected, aborted, canceled by them", our_goal_fails
    yield "the nodes of both are in both graphs, and go with their process", graphs


def unanswered() -> Iterator[tuple[str, Check]]:
    yield "a call to a server that cannot answer us ends with the reason and the remedy", no_answer


async def no_answer(bench: Bench) -> None:
    there = await bench.peer()
    await there.do("server", service="/ros/deaf", type=SetBool.__ros_type__, answers={})
    await until(lambda: bench.ours.services().get("/ros/deaf"), "its server is known")
    try:
        await bench.ours.node.call(Service(SetBool, "/ros/deaf"), SetBool.Request(data=True), timeout=10.0)
    except Exception as error:
        told = [str(error), *(f"{record.event} {record.fields}" for record in bench.ours.logs)]
    else:
        raise AssertionError("there was an answer")
    assert any("RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in line for line in told), told[-5:]


async def their_client(bench: Bench) -> None:
    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    bench.ours.node.serve(Service(AddTwoInts, "/ours/add"), add)
    there = await bench.peer()
    for a in (1, 2**62):
        request = {"a": a, "b": -5}
        answer = await there.do(
            "call", service="/ours/add", type=AddTwoInts.__ros_type__, request=request, timeout=30.0
        )
        assert answer == {"sum": a - 5}


async def their_client_of_trigger(bench: Bench) -> None:
    async def poke(request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True, message="größer")

    bench.ours.node.serve(Service(Trigger, "/ours/poke"), poke)
    there = await bench.peer()
    answer = await there.do("call", service="/ours/poke", type=Trigger.__ros_type__, request={}, timeout=30.0)
    assert answer == {"success": True, "message": "größer"}


async def our_client(bench: Bench) -> None:
    there = await bench.peer()
    answers = {"success": True, "message": "größer"}
    await there.do("server", service="/ros/switch", type=SetBool.__ros_type__, answers=answers)
    request = SetBool.Request(data=True)
    answer = await bench.ours.node.call(Service(SetBool, "/ros/switch"), request, timeout=30.0)
    assert answer == SetBool.Response(success=True, message="größer")
    assert (await there.until("asked", service="/ros/switch"))["request"] == {"data": True}
    await there.do("close", kind="server", name="/ros/switch")
    await until(lambda: not bench.ours.services().get("/ros/switch"), "its server has gone")


async def many_calls(bench: Bench) -> None:
    there = await bench.peer()
    await there.do("server", service="/ros/add", type=AddTwoInts.__ros_type__, answers={})
    service = Service(AddTwoInts, "/ros/add")
    await bench.ours.node.wait_for(service, timeout=30.0)
    requests = [AddTwoInts.Request(a=number, b=100) for number in range(20)]
    # a server of ROS 2 keeps its 10 newest requests that wait, and drops older ones
    answers = []
    for ten in (requests[:10], requests[10:]):
        answers += await asyncio.gather(*(bench.ours.node.call(service, one, timeout=30.0) for one in ten))
    assert [answer.sum for answer in answers] == [number + 100 for number in range(20)]


async def their(bench: Bench, action: Action[Any, Any, Any], goal: dict[str, Any], cancel_after: int = 0) -> Any:
    """How a goal of theirs ends; with `cancel_after`, they cancel it after so many feedbacks."""
    there = await bench.peer()
    return await there.do(
        "goal", action=action.name, type=action.type.__ros_type__, goal=goal, cancel_after=cancel_after, timeout=30.0
    )


async def their_goal(bench: Bench) -> None:
    end = await their(bench, COUNT, {"order": 6})
    assert (end["status"], end["result"]) == (SUCCEEDED, {"sequence": numbers(6)})
    assert end["feedbacks"] == [{"sequence": numbers(order)} for order in range(2, 7)]


async def their_goal_fails(bench: Bench) -> None:
    end = await their(bench, COUNT, {"order": 50})
    assert end == {"accepted": False}
    end = await their(bench, COUNT, {"order": 13})
    assert end["status"] == ABORTED
    end = await their(bench, COUNT, {"order": 40}, cancel_after=2)
    assert (end["status"], end["canceling"]) == (CANCELED, 0)
    assert 2 <= len(end["feedbacks"]) < 39


async def _their_server(bench: Bench) -> None:
    there = await bench.peer("counter")
    if THEIR_COUNT.name not in bench.ours.services():
        await there.do("action_server", action=THEIR_COUNT.name)
    await bench.ours.node.wait_for(THEIR_COUNT, timeout=30.0)


async def our_goal(bench: Bench) -> None:
    await _their_server(bench)
    async with bench.ours.node.send_goal(THEIR_COUNT, Fibonacci.Goal(order=6), timeout=30.0) as goal:
        feedbacks = [feedback.sequence.tolist() async for feedback in goal]
        result = await goal
    assert result.sequence.tolist() == numbers(6)
    assert feedbacks == [numbers(order) for order in range(2, 7)]


async def our_goal_fails(bench: Bench) -> None:
    await _their_server(bench)
    node = bench.ours.node
    try:
        await node.send_goal(THEIR_COUNT, Fibonacci.Goal(order=50), timeout=30.0).send()
    except GoalRejected:
        pass
    else:
        raise AssertionError("the goal was not rejected")
    for order, ending in ((13, GoalAborted), (40, GoalCanceled)):
        async with node.send_goal(THEIR_COUNT, Fibonacci.Goal(order=order), timeout=30.0) as goal:
            if order == 40:
                async for _ in goal:
                    break
                assert await goal.cancel()
            try:
                await goal
            except ending as end:
                sequence = getattr(end, "result").sequence  # noqa: B009
                if len(sequence) < 2:
                    raise AssertionError("its result is missing") from end
            else:
                raise AssertionError(f"the goal has not ended by {ending.__name__}")


async def graphs(bench: Bench) -> None:
    there, other = await bench.peer(), await bench.peer("other")
    await until(lambda: {"/ros/peer", "/ros/other"} <= bench.ours.nodes(), "theirs are known here")
    known = await there.do("nodes")
    while "/ours/robot" not in known:
        known = await there.do("nodes")
    assert {"/ours/robot", "/ros/peer"} <= set(known)
    other.process.kill()
    await until(lambda: "/ros/other" not in bench.ours.nodes(), "the killed one has gone")
    assert "/ros/peer" in bench.ours.nodes()
