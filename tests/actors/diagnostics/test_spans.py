"""Spans of calls and goals, as OpenTelemetry's own exporter in memory has them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import SpanKind, StatusCode, Tracer

from actors import (
    CallTimeout,
    Child,
    Done,
    GoalCanceled,
    GoalRejected,
    Node,
    Reject,
    Service,
    ServiceFailed,
    every,
    execute,
    parameter,
    run,
)
from actors.checks import create
from actors.diagnostics.spans import Spans
from actors.errors import NodeRestarting
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.replay import Journal, Recording, replay
from actors.system import System
from actors.testing import Rig
from actors.transport.bridge import connect
from tests.actors.transport.memory import Network
from tests.stage import ADD, COUNT, order, result, step, total, two

TWICE = Service(AddTwoInts, "twice")
INTROSPECTION = "service_configure_introspection"


class Store:
    """Where spans go, and those that have ended, in the order of their ends."""

    def __init__(self) -> None:
        self._exporter = InMemorySpanExporter()
        self.provider = TracerProvider()
        self.provider.add_span_processor(SimpleSpanProcessor(self._exporter))

    @property
    def ended(self) -> tuple[ReadableSpan, ...]:
        return self._exporter.get_finished_spans()

    def tracer(self) -> Tracer:
        return self.provider.get_tracer("test")

    def one(self, name: str, kind: SpanKind = SpanKind.SERVER) -> ReadableSpan:
        (found,) = (span for span in self.ended if span.name == name and span.kind is kind)
        return found


@pytest.fixture
def store() -> Iterator[Store]:
    made = Store()
    yield made
    made.provider.shutdown()


def seconds(span: ReadableSpan) -> float:
    assert span.start_time is not None
    assert span.end_time is not None
    return (span.end_time - span.start_time) / 1e9


def lies_below(below: ReadableSpan, above: ReadableSpan) -> bool:
    return below.parent is not None and below.parent.span_id == above.get_span_context().span_id  # type: ignore[union-attr]


class Adder(Node):
    """Adds after as many milliseconds as the second number says; refuses what is below zero."""

    introspection = parameter("off", name=INTROSPECTION, choices=("off", "metadata", "contents"))

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a < 0:
            raise ValueError("below zero")
        await self.clock.sleep(request.b / 1000)
        return total(request.a + request.b)


class Doubler(Node):
    """Asks the adder twice for each request, several requests at once."""

    @TWICE.serve(concurrent=2)
    async def twice(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        first = await self.call(ADD, two(request.a, request.b))
        second = await self.call(ADD, two(request.a, request.b))
        return total(first.sum + second.sum)


class Counter(Node):
    """Counts a second each; refuses to count to zero."""

    @COUNT.accepts
    def check(self, goal: Any) -> None:
        if goal.order == 0:
            raise Reject("nothing to count")

    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        for number in range(goal.order):
            await self.call(ADD, two(number, 0))
            yield step(number)
            await self.clock.sleep(1.0)
        yield Done(result(goal.order))


async def test_a_call_has_a_span_in_its_caller_and_below_it_one_in_its_server(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Child(Node, name="user"))
    await rig.node("user").call(ADD, two(1, 250))

    client, server = store.one("/add", SpanKind.CLIENT), store.one("/add")
    assert lies_below(server, client)
    assert client.parent is None
    assert client.attributes is not None
    assert server.attributes is not None
    assert (client.attributes["ros.node"], server.attributes["ros.node"]) == ("/user", "/adder")
    assert client.attributes["ros.call_id"] == server.attributes["ros.call_id"]
    assert seconds(server) == pytest.approx(0.25)
    assert server.status.status_code is StatusCode.UNSET


async def test_calls_of_a_handler_lie_below_its_own_span_and_those_after_it_do_not(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Doubler, Child(Node, name="user"))
    user = rig.node("user")
    await asyncio.gather(user.call(TWICE, two(1, 10)), user.call(TWICE, two(2, 20)))
    await user.call(ADD, two(5, 0))

    handlers = [span for span in store.ended if span.name == "/twice" and span.kind is SpanKind.SERVER]
    asked = [span for span in store.ended if span.name == "/add" and span.kind is SpanKind.CLIENT]
    assert [sum(lies_below(span, handler) for span in asked) for handler in handlers] == [2, 2]
    assert asked[-1].parent is None
    assert len({span.context.trace_id for span in store.ended if span.context is not None}) == 3


async def test_the_span_of_a_handler_is_the_current_one_for_spans_of_its_own(rig: Rig, store: Store) -> None:
    class Measuring(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            with store.tracer().start_as_current_span("think"):
                await self.clock.sleep(0.5)
            return total(0)

    rig.observe(Spans(store.provider))
    await rig.start(Measuring, Child(Node, name="user"))
    await rig.node("user").call(ADD, two(1, 1))
    with store.tracer().start_as_current_span("outside"):
        await rig.node("user").call(ADD, two(1, 1))

    thought = [span for span in store.ended if span.name == "think"]
    served = [span for span in store.ended if span.kind is SpanKind.SERVER]
    called = [span for span in store.ended if span.kind is SpanKind.CLIENT]
    assert [lies_below(*pair) for pair in zip(thought, served, strict=True)] == [True, True]
    assert lies_below(called[1], store.one("outside", SpanKind.INTERNAL))


async def test_a_call_that_fails_says_so_at_both_ends(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Child(Node, name="user"))
    with pytest.raises(ServiceFailed):
        await rig.node("user").call(ADD, two(-1, 0))

    for kind in (SpanKind.CLIENT, SpanKind.SERVER):
        span = store.one("/add", kind)
        assert span.status.status_code is StatusCode.ERROR
        assert span.status.description is not None
        assert "below zero" in span.status.description
        assert span.attributes is not None
        assert span.attributes["error.type"] == "ServiceFailed"


async def test_a_call_that_is_not_answered_in_time_has_failed_and_its_handler_is_measured_to_its_end(
    rig: Rig, store: Store
) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Child(Node, name="user"))
    with pytest.raises(CallTimeout):
        await rig.node("user").call(ADD, two(1, 3000), timeout=1.0)
    await rig.advance(5.0)

    assert seconds(store.one("/add", SpanKind.CLIENT)) == pytest.approx(1.0)
    assert seconds(store.one("/add")) == pytest.approx(3.0)
    assert store.one("/add").status.status_code is StatusCode.ERROR


async def test_a_caller_that_gives_up_and_a_server_that_ends_are_told(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Doubler, Child(Node, name="user"))
    call = asyncio.ensure_future(rig.node("user").call(TWICE, two(1, 500), timeout=5.0))
    await rig.advance(0.1)
    call.cancel()
    await rig.advance(2.0)
    other = asyncio.ensure_future(rig.node("user").call(TWICE, two(1, 500), timeout=5.0))
    await rig.advance(0.1)
    rig.crash("doubler")
    with pytest.raises(NodeRestarting):
        await other

    called = [span.status.description for span in store.ended if span.name == "/twice" and span.kind is SpanKind.CLIENT]
    served = [span.status.description for span in store.ended if span.name == "/twice" and span.kind is SpanKind.SERVER]
    assert (called[0], served) == ("the caller has given up", ["the caller has given up", "the node has ended"])
    assert "/doubler" in str(called[1])


async def test_a_goal_is_one_span_from_its_request_to_its_end_with_its_calls_below_it(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Counter)
    async with await rig.send_goal(COUNT, order(3)) as goal:
        await goal

    span = store.one("/count")
    assert seconds(span) == pytest.approx(3.0)
    assert span.attributes is not None
    assert (span.attributes["ros.goal_status"], span.attributes["ros.node"]) == ("SUCCEEDED", "/counter")
    assert span.attributes["ros.goal_id"] == goal.goal_id.hex()
    assert [event.name for event in span.events] == ["executing"]
    asked = [one for one in store.ended if one.name == "/add" and one.kind is SpanKind.CLIENT]
    assert [lies_below(one, span) for one in asked] == [True, True, True]


async def test_goals_that_are_rejected_canceled_or_of_a_known_id_have_failed_for_their_reason(
    rig: Rig, store: Store
) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Counter)
    with pytest.raises(GoalRejected):
        await rig.send_goal(COUNT, order(0))
    async with await rig.send_goal(COUNT, order(50)) as goal:
        server = rig.system.graph.action("/count").local
        assert server is not None
        second = server.submit(goal.goal_id, order(5), None).future
        with pytest.raises(Reject, match="in use"):
            await second
        await goal.cancel("no more")
        with pytest.raises(GoalCanceled):
            await goal

    described = [span.status.description for span in store.ended if span.name == "/count"]
    assert described[0] == "nothing to count"
    assert "in use already" in str(described[1])
    assert described[2] == "no more"
    assert store.ended[-1].attributes is not None
    assert store.ended[-1].attributes["ros.goal_status"] == "CANCELED"


async def test_a_node_that_publishes_its_calls_has_spans_too_whenever_it_begins_to(rig: Rig, store: Store) -> None:
    rig.observe(Spans(store.provider))
    await rig.start(Adder, Child(Node, name="user"))
    call = asyncio.ensure_future(rig.node("user").call(ADD, two(1, 500)))
    await rig.advance(0.1)
    rig.node("adder").set_parameter(INTROSPECTION, "contents")
    await call
    await rig.node("user").call(ADD, two(1, 0))
    assert [span.kind for span in store.ended].count(SpanKind.SERVER) == 2


async def test_the_two_spans_of_a_call_between_processes_have_the_same_id_and_traces_of_their_own(store: Store) -> None:
    network, far = Network(), create(System, sinks=())
    Spans(store.provider).attach(far)
    connect(far.runtime, network.end())
    far.open()
    async with run(Adder, transport=network.end(), sinks=(), observers=(Spans(store.provider),)):
        user = await far.join(Child(Node, name="user"))
        await far.runtime.opened()
        await user.node.wait_for(ADD, timeout=10.0)
        await user.node.call(ADD, two(1, 1))
        await far.stop("the test is over")

    client, server = store.one("/add", SpanKind.CLIENT), store.one("/add")
    assert client.attributes is not None
    assert server.attributes is not None
    assert client.attributes["ros.call_id"] == server.attributes["ros.call_id"]
    assert server.parent is None


async def test_spans_are_those_of_one_system(rig: Rig, store: Store) -> None:
    spans = Spans(store.provider)
    rig.observe(spans)
    await rig.start(Adder)
    with pytest.raises(RuntimeError, match="make others"):
        spans.attach(rig.system)


class Asking(Node):
    @every(hz=100)
    async def ask(self) -> None:
        await self.call(ADD, two(round(self.clock.now() * 1e9), 0))


class Late(Node):
    @ADD.serve()
    async def add(self, request: Any) -> Any:
        return total(request.a - round(self.clock.now() * 1e9))


def test_spans_beside_a_journal_read_the_clock_for_no_node(store: Store) -> None:
    """What a journaled node reads is replayed; the spans of its calls are not made in a replay."""

    async def main() -> tuple[Recording, ...]:
        journal = Journal("asking", "late")
        async with run(Late, Asking, observers=(Spans(store.provider), journal), sinks=()):
            await asyncio.sleep(0.1)
        return journal.recording("asking"), journal.recording("late")

    for recording in execute(main, clock="real"):
        assert len(list(recording.outputs())) > 2
        verdict = replay(recording)
        assert verdict.equal, verdict
    assert len(store.ended) > 4
