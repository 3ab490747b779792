"""Service introspection: what services, clients and actions tell of their calls, if their node's parameters say so."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import (
    CallTimeout,
    Child,
    Done,
    GoalCanceled,
    Node,
    Service,
    ServiceFailed,
    StartFailed,
    Topic,
    parameter,
    run,
)
from actors.checks import create
from actors.interfaces import get_message
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.logs import LogRecord
from actors.system import System
from actors.testing import Rig
from actors.transport.bridge import connect
from tests.actors.transport.memory import Network
from tests.stage import ADD, COUNT, order, result, step, total, two

EVENTS = Topic(get_message("example_interfaces/srv/AddTwoInts_Event"), "/add/_service_event")
GOALS = Topic(
    get_message("example_interfaces/action/Fibonacci_SendGoal_Event"), "/count/_action/send_goal/_service_event"
)
RESULTS = Topic(
    get_message("example_interfaces/action/Fibonacci_GetResult_Event"), "/count/_action/get_result/_service_event"
)
SERVICE, CLIENT = "service_configure_introspection", "client_configure_introspection"
ACTION = "action_server_configure_introspection"
OTHER = Service(AddTwoInts, "other")
SENT, RECEIVED, ANSWERED, RETURNED = range(4)


class Adder(Node):
    @ADD.serve()
    async def add(self, request: Any) -> Any:
        if request.a < 0:
            raise ValueError("below zero")
        await self.clock.sleep(request.b / 1000)
        return total(request.a + request.b)


class Told(Adder):
    """Declares the parameter itself, as the demo of ROS 2 does."""

    introspection = parameter("metadata", name=SERVICE, choices=("off", "metadata", "contents"))


class Counter(Node):
    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        for number in range(goal.order):
            yield step(number)
            await self.clock.sleep(1.0)
        yield Done(result(goal.order))


def steps(events: Any) -> list[tuple[int, int]]:
    return [(one.info.event_type, one.info.sequence_number) for one in events]


async def test_nothing_is_told_unless_a_parameter_says_so(rig: Rig) -> None:
    await rig.start(Adder)
    heard = rig.probe(EVENTS)
    await rig.call(ADD, two(1, 2))
    assert len(heard) == 0
    assert SERVICE not in rig.node(Adder).declarations.table.values


async def test_a_server_tells_of_the_request_it_takes_and_the_response_it_gives(rig: Rig) -> None:
    await rig.start(Child(Adder, parameters={SERVICE: "contents"}))
    heard = rig.probe(EVENTS)
    await rig.advance(5.0)
    await rig.call(ADD, two(1, 500))
    await rig.call(ADD, two(3, 0))
    assert steps(heard) == [(RECEIVED, 1), (ANSWERED, 1), (RECEIVED, 2), (ANSWERED, 2)]
    assert [one.request[0].b for one in heard if len(one.request)] == [500, 0]
    assert [one.response[0].sum for one in heard if len(one.response)] == [501, 3]
    assert [(one.info.stamp.sec, one.info.stamp.nanosec) for one in heard][:2] == [(5, 0), (5, 500_000_000)]
    assert len({bytes(one.info.client_gid) for one in heard}) == 1


async def test_a_client_tells_of_the_request_it_sends_and_the_response_it_gets(rig: Rig) -> None:
    await rig.start(Adder, Child(Node, name="user", parameters={CLIENT: "contents"}))
    heard = rig.probe(EVENTS)
    user = rig.node("user")
    await user.call(ADD, two(1, 2))
    with pytest.raises(ServiceFailed):
        await user.call(ADD, two(-1, 2))
    with pytest.raises(CallTimeout):
        await user.call(ADD, two(1, 5000), timeout=0.1)
    assert steps(heard) == [(SENT, 1), (RETURNED, 1), (SENT, 2), (SENT, 3)], "a failure is no response"
    assert heard[1].response[0].sum == 3


async def test_the_clients_of_a_node_are_told_apart(rig: Rig) -> None:
    class Both(Adder):
        @OTHER.serve()
        async def other(self, request: Any) -> Any:
            return total(0)

    await rig.start(Child(Both, parameters={SERVICE: "metadata"}))
    heard = [rig.probe(EVENTS), rig.probe(Topic(EVENTS.type, "/other/_service_event"))]
    await rig.call(ADD, two(1, 2))
    await rig.call(OTHER, two(1, 2))
    assert len({bytes(one.info.client_gid) for probe in heard for one in probe}) == 2


async def test_metadata_leave_the_contents_out(rig: Rig) -> None:
    await rig.start(Told)
    heard = rig.probe(EVENTS)
    await rig.call(ADD, two(1, 2))
    assert steps(heard) == [(RECEIVED, 1), (ANSWERED, 1)]
    assert [(len(one.request), len(one.response)) for one in heard] == [(0, 0), (0, 0)]


async def test_it_can_be_changed_while_the_node_runs(rig: Rig) -> None:
    both = {SERVICE: "disabled", CLIENT: "off", ACTION: "off"}
    await rig.start(
        Child(Adder, parameters=both),
        Child(Counter, parameters={ACTION: "off"}),
        Child(Node, name="user", parameters=both),
    )
    calls, goals = rig.probe(EVENTS), rig.probe(GOALS)
    user = rig.node("user")
    await user.call(ADD, two(1, 2))
    assert rig.node(Adder).set_parameter(SERVICE, "metadata").successful
    assert user.set_parameter(CLIENT, "metadata").successful
    assert rig.node(Counter).set_parameter(ACTION, "contents").successful
    await user.call(ADD, two(1, 2))
    async with await rig.send_goal(COUNT, order(0)) as goal:
        await goal
    assert steps(calls) == [(SENT, 2), (RECEIVED, 2), (ANSWERED, 2), (RETURNED, 2)]
    assert steps(goals) == [(RECEIVED, 1), (ANSWERED, 1)]
    assert not rig.node(Adder).set_parameter(SERVICE, "everything").successful
    rig.node(Adder).set_parameter(SERVICE, "off")
    user.set_parameter(CLIENT, "disabled")
    rig.node(Counter).set_parameter(ACTION, "off")
    await user.call(ADD, two(1, 2))
    async with await rig.send_goal(COUNT, order(0)) as goal:
        await goal
    assert (len(calls), len(goals)) == (4, 2)


async def test_a_value_that_is_none_is_refused_at_the_start(rig: Rig) -> None:
    rig.expect_failure()
    with pytest.raises(StartFailed, match="service_configure_introspection"):
        await rig.start(Child(Adder, parameters={SERVICE: "loud"}))


async def test_a_parameter_file_may_give_it_to_all_nodes() -> None:
    everywhere = {"/**": {SERVICE: "contents", CLIENT: "contents"}}
    async with run(Adder, Child(Node, name="user"), parameters=everywhere, sinks=()) as system:
        heard = system.node("user").subscribe(EVENTS)
        await system.node("user").call(ADD, two(1, 2))
        found = [await heard.next(timeout=1.0) for _ in range(4)]
    assert steps(found) == [(SENT, 1), (RECEIVED, 1), (ANSWERED, 1), (RETURNED, 1)]
    assert len({bytes(one.info.client_gid) for one in found}) == 1


async def test_an_action_tells_of_requests_answers_and_results(rig: Rig) -> None:
    await rig.start(Child(Counter, parameters={ACTION: "contents"}))
    goals, results = rig.probe(GOALS), rig.probe(RESULTS)
    async with await rig.send_goal(COUNT, order(2)) as goal:
        await goal
    async with await rig.send_goal(COUNT, order(50)) as long:
        await long.cancel()
        with pytest.raises(GoalCanceled):
            await long
    assert steps(goals) == [(RECEIVED, 1), (ANSWERED, 1), (RECEIVED, 2), (ANSWERED, 2)]
    assert [one.request[0].goal.order for one in goals if len(one.request)] == [2, 50]
    assert [(one.response[0].status, list(one.response[0].result.sequence)) for one in results] == [(4, [2]), (5, [])]
    assert bytes(goals[0].request[0].goal_id.uuid) != bytes(goals[2].request[0].goal_id.uuid)


async def test_a_client_that_gives_up_before_its_goal_is_answered_leaves_no_answer_behind(rig: Rig) -> None:
    await rig.start(Child(Counter, parameters={ACTION: "contents"}))
    goals = rig.probe(GOALS)
    server = rig.system.graph.action("/count").local
    assert server is not None
    server.submit(bytes(16), order(1), None).future.cancel()
    await rig.quiet()
    assert steps(goals) == [(RECEIVED, 1)]


async def test_a_call_that_gets_no_answer_tells_of_none(rig: Rig) -> None:
    """Neither one that takes too long, nor one whose turn comes only after its client has given up."""
    await rig.start(
        Child(Adder, parameters={SERVICE: "metadata"}), Child(Node, name="user", parameters={CLIENT: "metadata"})
    )
    heard = rig.probe(EVENTS)
    calls = [rig.node("user").call(ADD, two(1, 200), timeout=0.1) for _ in range(2)]
    ends = await asyncio.gather(*calls, return_exceptions=True)
    await rig.advance(1.0)
    assert [type(end) for end in ends] == [CallTimeout, CallTimeout]
    assert steps(heard) == [(SENT, 1), (SENT, 2), (RECEIVED, 1)]


async def test_a_client_that_is_made_anew_tells_as_before(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("actors.runtime.endpoints.CLIENTS", 1)  # of a node that calls more services than are kept
    user = Child(Node, name="user", parameters={CLIENT: "metadata"})
    await rig.start(Adder, Child(Adder, name="second", remap={"add": "other"}), user)
    heard = rig.probe(EVENTS)
    for service in (ADD, OTHER, ADD):
        await rig.node("user").call(service, two(1, 2))
    await rig.quiet()
    assert steps(heard) == [(SENT, 1), (RETURNED, 1), (SENT, 2), (RETURNED, 2)]


async def test_a_node_that_has_ended_tells_nothing_more(rig: Rig) -> None:
    await rig.start(Adder, Child(Node, name="user", parameters={CLIENT: "contents"}))
    heard = rig.probe(EVENTS)
    call = asyncio.ensure_future(rig.node("user").call(ADD, two(1, 100)))
    await rig.quiet()
    rig.node("user").stop()
    await rig.quiet()
    await rig.advance(1.0)
    call.cancel()
    assert steps(heard) == [(SENT, 1)]


async def test_over_two_processes_both_ends_name_a_call_alike() -> None:
    network, lines = Network(), list[LogRecord]()
    far = create(System, sinks=())
    connect(far.runtime, network.end())
    far.open()
    async with run(
        Child(Adder, parameters={SERVICE: "contents"}), transport=network.end(), sinks=(lines.append,)
    ) as near:
        node = await far.join(Child(Node, name="user", parameters={CLIENT: "contents"}))
        await far.runtime.opened()
        await asyncio.sleep(0.05)
        here, there = near.node(Adder).subscribe(EVENTS), node.node.subscribe(EVENTS)
        await asyncio.sleep(0.05)
        for b in (1, 2):
            await node.node.call(ADD, two(1, b))
        for heard in (here, there):
            found = [await heard.next(timeout=5.0) for _ in range(8)]
            assert sorted(steps(found)) == sorted([(kind, number) for number in (1, 2) for kind in range(4)])
            assert len({bytes(one.info.client_gid) for one in found}) == 1
        await far.stop("the test is over")


async def test_what_is_set_for_servers_alone_says_nothing_of_clients(rig: Rig) -> None:
    await rig.start(Adder, Child(Node, name="user", parameters={SERVICE: "contents"}))
    heard = rig.probe(EVENTS)
    assert await rig.node("user").call(ADD, two(1, 2)) == total(3)
    await rig.settled()
    assert steps(heard) == []
