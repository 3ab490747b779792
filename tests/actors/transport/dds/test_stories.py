"""What two processes do together over DDS, as over Zenoh: topics, services, actions, the graph, and what is told of their ends."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from actors import Child, Done, GoalRejected, GoalStatus, Node, Reject, Service, ServiceFailed, System, Topic, qos, run
from actors.actions.server import ActionServer
from actors.errors import CallCycle, CallTimeout, NotRunning
from actors.interfaces.rcl_interfaces.srv import ListParameters
from actors.interfaces.std_srvs.srv import SetBool
from actors.qos.policies import Liveliness, QoS, Reliability
from actors.transport.dds.known import Known
from actors.transport.protocol import Transport
from tests.actors.transport.dds.meeting import MeetingTransport, free_domain
from tests.actors.transport.zenoh.wires import PeerWire
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, step, total, two

pytest.importorskip("cyclonedds")
SWITCH = Service(SetBool, "switch")
STATE = Topic(NUMBERS.type, "state", qos.LATCHED.replace(depth=2))


@pytest.fixture(params=["dds", "zenoh"])
def meet(request: pytest.FixtureRequest) -> Callable[[], Transport]:
    """Makes transports that find each other, and nobody else."""
    if request.param == "zenoh":
        return PeerWire().transport
    domain = free_domain()
    return lambda: MeetingTransport(domain)


class Server(Node):
    @ADD.serve()
    async def add(self, request: Any) -> Any:
        if request.a < 0:
            raise ValueError("negative numbers are not added here")
        return total(request.a + request.b)

    @COUNT.accepts
    def consider(self, goal: Any) -> None:
        if goal.order > 9:
            raise Reject("too far to count")

    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        for at in range(goal.order):
            yield step(at)
            await self.clock.sleep(0.01)
        yield Done(result(goal.order))


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():
            await asyncio.sleep(0.005)


def names(system: System) -> list[str]:
    return [node.name for node in system.snapshot().nodes if node.state == "elsewhere"]


async def test_messages_cross_both_ways_in_order_and_those_that_are_kept_reach_who_comes_late(
    meet: Callable[[], Transport],
) -> None:
    async with (
        run(Child(Node, name="a"), transport=meet(), sinks=()) as one,
        run(Child(Node, name="b"), transport=meet(), sinks=()) as other,
    ):
        a, b = one.node("a"), other.node("b")
        kept, out = a.publisher(STATE), a.publisher(NUMBERS)
        for value in (1, 2, 3):
            kept.publish(number(value))
        async with b.subscribe(STATE) as latched, b.subscribe(NUMBERS) as stream:
            assert [(await latched.next()).data for _ in "ab"] == [2, 3]
            await until(lambda: out.subscription_count == 1)
            for value in range(50):
                out.publish(number(value))
            assert [(await stream.next()).data for _ in range(50)] == list(range(50))
            (edge,) = {
                (edge.host != "", edge.process > 0)
                for view in other.snapshot().topics
                if view.name == "/numbers"
                for edge in view.publishers
            }
            assert edge == (True, True), "it is known where the publisher runs"


async def test_a_call_is_answered_and_an_error_keeps_its_text(meet: Callable[[], Transport]) -> None:
    async with (
        run(Child(Server, name="server"), transport=meet(), sinks=()),
        run(Child(Node, name="client"), transport=meet(), sinks=()) as near,
    ):
        client = near.node("client")
        assert await client.call(ADD, two(1, 2), timeout=20.0) == total(3)
        answers = await asyncio.gather(*(client.call(ADD, two(value, 1), timeout=20.0) for value in range(20)))
        assert answers == [total(value + 1) for value in range(20)]
        with pytest.raises(ServiceFailed, match="negative numbers are not added here"):
            await client.call(ADD, two(-1, 0), timeout=20.0)


class Refusing(Node):
    @SWITCH.serve()
    async def switch(self, request: Any) -> Any:
        raise ValueError("no such switch")

    @ADD.serve()
    async def add(self, request: Any) -> Any:
        raise ValueError("negative numbers are not added here")


async def test_over_dds_a_client_of_ros2_is_told_of_an_error_where_the_response_has_a_field_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Known, "ours", lambda *_: False)  # each takes the other for a process of ROS 2
    domain = free_domain()
    async with (
        run(Child(Refusing, name="server"), transport=MeetingTransport(domain), sinks=()),
        run(Child(Node, name="client"), transport=MeetingTransport(domain), sinks=()) as near,
    ):
        client = near.node("client")
        answer = await client.call(SWITCH, SetBool.Request(data=True), timeout=20.0)
        assert answer == SetBool.Response(
            success=False, message="/server failed to serve the request: ValueError: no such switch"
        )
        with pytest.raises(CallTimeout):
            await client.call(ADD, two(-1, 0), timeout=1.0)


async def test_a_goal_is_followed_with_feedback_and_a_rejection_says_why(meet: Callable[[], Transport]) -> None:
    async with (
        run(Child(Server, name="server"), transport=meet(), sinks=()),
        run(Child(Node, name="client"), transport=meet(), sinks=()) as near,
    ):
        client = near.node("client")
        await until(lambda: near.graph.action("/count").remotes)
        async with client.send_goal(COUNT, order(3)) as goal:
            heard = [one.sequence.tolist() async for one in goal]
            assert await goal == result(3)
        assert heard == [[0], [1], [2]]
        with pytest.raises(GoalRejected, match="too far to count"):
            await client.send_goal(COUNT, order(10)).send()


async def test_every_node_has_its_standard_services_and_its_end_is_seen(meet: Callable[[], Transport]) -> None:
    async with run(Child(Node, name="client"), transport=meet(), sinks=()) as near:
        async with run(Child(Server, name="server"), transport=meet(), sinks=()):
            await until(lambda: names(near) == ["/server"])
            listed = Service(ListParameters, "/server/list_parameters")
            answer = await near.node("client").call(listed, ListParameters.Request(), timeout=20.0)
            assert "use_sim_time" in answer.result.names
        await until(lambda: names(near) == [])


class Slow(Node):
    @ADD.serve()
    async def add(self, request: Any) -> Any:
        await self.clock.sleep(60.0)
        return total(0)


async def test_a_call_whose_server_ends_ends_with_an_error_that_names_it(meet: Callable[[], Transport]) -> None:
    async with run(Child(Node, name="client"), transport=meet(), sinks=()) as near:
        async with run(Child(Slow, name="slow"), transport=meet(), sinks=()):
            await until(lambda: near.graph.service("/add").remotes)
            call = asyncio.create_task(near.node("client").call(ADD, two(1, 2), timeout=60.0))
            await asyncio.sleep(0.3)
        with pytest.raises((NotRunning, ServiceFailed), match="/slow"):
            async with asyncio.timeout(20.0):
                await call


async def test_a_cycle_of_calls_through_two_processes_is_found(meet: Callable[[], Transport]) -> None:
    first, second = Service(ADD.type, "first"), Service(ADD.type, "second")

    class First(Node):
        @first.serve()
        async def answer(self, request: Any) -> Any:
            return await self.call(second, request, timeout=30.0)

    class Second(Node):
        @second.serve()
        async def answer(self, request: Any) -> Any:
            return await self.call(first, request, timeout=30.0)

    async with (
        run(Child(First, name="one"), transport=meet(), sinks=()) as near,
        run(Child(Second, name="two"), transport=meet(), sinks=()) as far,
    ):
        await until(lambda: near.graph.service("/second").remotes and far.graph.service("/first").remotes)
        caller = await near.join(Child(Node, name="caller"))
        with pytest.raises((CallCycle, ServiceFailed), match="/one"):
            await caller.node.call(first, two(1, 2), timeout=20.0)


async def test_qos_events_come_from_publishers_and_subscriptions_elsewhere(meet: Callable[[], Transport]) -> None:
    weak = Topic(NUMBERS.type, "weak", qos.DEFAULT.replace(reliability=Reliability.BEST_EFFORT))
    strict = Topic(NUMBERS.type, "weak", qos.DEFAULT)
    timed = Topic(NUMBERS.type, "timed", QoS(depth=1, deadline=0.3))
    manual = Topic(NUMBERS.type, "manual", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=0.3))
    async with (
        run(Child(Node, name="a"), transport=meet(), sinks=()) as one,
        run(Child(Node, name="b"), transport=meet(), sinks=()) as other,
    ):
        a, b = one.node("a"), other.node("b")
        offered, late, silent = a.publisher(weak), a.publisher(timed), a.publisher(manual)
        async with b.subscribe(strict) as wanting, b.subscribe(timed) as waiting, b.subscribe(manual) as watching:
            await until(lambda: offered.status.incompatible_qos and wanting.status.incompatible_qos)
            assert offered.status.last_policy_kind == wanting.status.last_policy_kind == "RELIABILITY"
            assert offered.subscription_count == 0

            await until(lambda: late.subscription_count and silent.subscription_count)
            late.publish(number(1))
            silent.publish(number(1))
            await until(lambda: waiting.status.deadline_missed and late.status.deadline_missed)
            await until(lambda: watching.status.not_alive == 1)
            silent.publish(number(2))
            await until(lambda: watching.status.alive == 1)


async def test_a_publisher_that_asserts_its_liveliness_is_alive_elsewhere_without_messages() -> None:
    domain = free_domain()
    beat = Topic(NUMBERS.type, "beat", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=1.0))
    async with (
        run(Child(Node, name="a"), transport=MeetingTransport(domain), sinks=()) as one,
        run(Child(Node, name="b"), transport=MeetingTransport(domain), sinks=()) as other,
    ):
        out = one.node("a").publisher(beat)
        async with other.node("b").subscribe(beat) as watching:
            await until(lambda: out.subscription_count and watching.status.matched)
            out.publish(number(1))
            await until(lambda: watching.status.alive == 1)
            begin, lost = asyncio.get_running_loop().time(), out.status.liveliness_lost
            while asyncio.get_running_loop().time() < begin + 2.5:  # more than twice its lease
                out.assert_liveliness()
                await asyncio.sleep(0.02)
            if out.status.liveliness_lost == lost:  # a busy machine may have kept it from that
                assert watching.status.alive == 1
            await until(lambda: watching.status.not_alive == 1)


async def test_a_goal_that_is_accepted_after_the_end_of_its_node_does_not_run_on(meet: Callable[[], Transport]) -> None:
    asked, go_on = asyncio.Event(), asyncio.Event()

    class Slow(Node):
        @COUNT.accepts
        async def consider(self, goal: Any) -> None:
            asked.set()
            await go_on.wait()

        @COUNT.serve()
        async def count(self, goal: Any) -> Any:
            await self.clock.sleep(1000.0)
            yield Done(result(0))

    async with run(Slow, transport=meet(), sinks=()) as here, run(Node, transport=meet(), sinks=()) as there:
        asker = await there.join(Child(Node, name="asker"))
        sending = asyncio.create_task(asker.node.send_goal(COUNT, order(1), timeout=60.0).send())
        await asked.wait()
        sending.cancel()
        await there.leave(asker)
        go_on.set()

        server = here.graph.action("/count").server
        assert isinstance(server, ActionServer)
        await until(lambda: [goal.status for goal in server.table.records()] == [GoalStatus.CANCELED])
        await until(lambda: "/asker" not in [node.name for node in here.snapshot().nodes])
