"""`open_node`: a node for a script, alone or beside a running tree."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import (
    Child,
    DeclarationError,
    Node,
    ServiceUnavailable,
    Stop,
    Supervisor,
    System,
    Topic,
    every,
    open_node,
    publishes,
    run,
)
from actors.checks import create
from actors.errors import Ended, NotRunning
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.runtime.incarnation import incarnation_of
from actors.system import system_here, system_of
from actors.testing import Rig
from tests.actors.transport.memory import Network
from tests.stage import ADD, NUMBERS, number, total, two

pytestmark = pytest.mark.virtual


class Ear:
    """A sink that keeps what it hears."""

    def __init__(self) -> None:
        self.records: list[LogRecord] = []

    def __call__(self, record: LogRecord) -> None:
        self.records.append(record)


def opened(name: str, **options: Any) -> Any:
    return open_node(name, sinks=(Ear(),), **options)


async def test_alone_with_a_transport_it_is_known_to_other_processes_until_it_ends() -> None:
    network = Network()
    async with opened("listener", transport=network.end()) as node:
        await node.clock.sleep(0.1)
        assert [token for token in network.tokens if "/listener" in token or "%listener" in token]
    assert not network.tokens


async def test_alone_it_is_a_system_of_its_own_that_ends_with_it() -> None:
    async with opened("listener", namespace="/lab") as node:
        assert node.fqn == "/lab/listener"
        assert system_here() is system_of(node)
        stream = node.subscribe(NUMBERS)
        node.publisher(NUMBERS)(number(1))
        assert await stream.next() == number(1)
        with pytest.raises(ServiceUnavailable):
            await node.call(ADD, two(1, 2))
    assert system_here() is None
    assert asyncio.all_tasks() == {asyncio.current_task()}
    with pytest.raises(Ended):
        node.publisher(NUMBERS)


async def test_it_talks_to_the_tree_that_runs_in_this_loop() -> None:
    class Talker(Node):
        out = publishes(NUMBERS)
        count = 0

        @every(hz=10)
        async def talk(self) -> None:
            self.count += 1
            self.out(number(self.count))

    async with run(Child(Talker), sinks=(Ear(),)) as system, opened("listener") as node:
        assert system_of(node) is system
        seen: list[int] = []
        async for message in node.subscribe(NUMBERS):
            seen.append(message.data)
            if len(seen) == 3:
                break
        assert seen == [1, 2, 3]
        assert system.clock.now() == pytest.approx(0.3)


async def test_nodes_nest_and_the_system_ends_with_the_last_one() -> None:
    async with opened("outer") as outer:
        async with opened("inner") as inner:
            assert system_of(inner) is system_of(outer)
            inner.serve(ADD, answer)
            assert (await outer.call(ADD, two(1, 2))).sum == 3
        with pytest.raises(NotRunning):
            await outer.call(ADD, two(1, 2))
        assert system_here() is system_of(outer)
    assert system_here() is None


async def test_the_first_may_leave_before_the_second() -> None:
    first, second = opened("first"), opened("second")
    node = await first.__aenter__()
    other = await second.__aenter__()
    await first.__aexit__(None, None, None)
    assert system_here() is system_of(other)
    with pytest.raises(Ended):
        node.publisher(NUMBERS)
    other.publisher(NUMBERS)
    await second.__aexit__(None, None, None)
    assert system_here() is None


async def answer(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return total(request.a + request.b)


async def test_it_joins_the_system_it_is_given() -> None:
    other = create(System, sinks=(Ear(),))
    await other.start(Supervisor("other"))
    async with run(Supervisor("newest"), sinks=(Ear(),)), open_node("guest", system=other) as node:
        assert system_of(node) is other
    await other.stop()


async def test_handlers_and_parameters_work_without_a_class() -> None:
    seen: list[int] = []

    async def take(message: Int32) -> None:
        seen.append(message.data)

    async with opened("listener", remap={"numbers": "/elsewhere"}, parameters={}) as node:
        node.on(NUMBERS, take)
        node.on(NUMBERS, lambda message: seen.append(-message.data))
        node.publisher(Topic(Int32, "/elsewhere"))(number(5))
        await node.clock.sleep(0.0)
        assert seen == [5, -5]


async def test_a_second_one_of_a_name_is_refused_and_the_name_is_free_after_the_first() -> None:
    async with opened("listener"):
        with pytest.raises(DeclarationError, match="would be the second node named /listener"):
            async with opened("listener", namespace="/"):
                raise AssertionError("the block must not be entered")
    for _ in range(2):
        async with opened("listener") as node:
            assert node.incarnation == 1


async def test_a_name_that_is_none_fails_and_leaves_nothing() -> None:
    with pytest.raises(DeclarationError, match="9lives"):
        async with opened("9lives"):
            raise AssertionError("the block must not be entered")
    assert system_here() is None


async def test_a_handler_that_fails_ends_the_node_its_streams_and_at_the_latest_the_block() -> None:
    def take(message: Int32) -> None:
        raise ValueError("cannot digest this")

    ear = Ear()
    rest: list[int] = []
    with pytest.raises(ValueError, match="cannot digest this"):
        async with open_node("listener", sinks=(ear,)) as node:
            node.on(NUMBERS, take)
            stream = node.subscribe(NUMBERS)
            node.publisher(NUMBERS)(number(1))
            async for message in stream:
                rest.append(message.data)
    assert rest == [1]
    await asyncio.sleep(0)
    (record,) = [record for record in ear.records if record.event == "a node beside the tree failed"]
    assert str(record.fields.pop("at")).startswith(f"{__file__}:")
    assert record.fields == {"node_name": "/listener", "error": "ValueError: cannot digest this"}
    assert 'raise ValueError("cannot digest this")\nValueError: cannot digest this' in record.traceback
    assert system_here() is None


async def test_an_exception_of_the_block_comes_before_the_nodes() -> None:
    def take(message: Int32) -> None:
        raise ValueError("cannot digest this")

    with pytest.raises(LookupError, match="mine"):
        async with opened("listener") as node:
            node.on(NUMBERS, take)
            node.publisher(NUMBERS)(number(1))
            await node.clock.sleep(1.0)
            raise LookupError("mine")
    assert system_here() is None


async def test_a_node_that_failed_beside_a_tree_serves_nobody_any_more() -> None:
    async def fail(request: AddTwoInts.Request) -> AddTwoInts.Response:
        raise Stop("enough")

    async with run(Supervisor("system"), sinks=(Ear(),)) as system, opened("client") as client:
        guest = opened("server")
        node = await guest.__aenter__()
        node.serve(ADD, fail)
        with pytest.raises(Exception, match="enough"):
            await client.call(ADD, two(1, 2))
        await client.clock.sleep(0.1)
        with pytest.raises(NotRunning, match="/server, which served /add, has stopped"):
            await client.call(ADD, two(1, 2))
        with pytest.raises(Stop):
            await guest.__aexit__(None, None, None)
        assert [state.identity.name for state in system.nodes.values()] == ["client"]


async def test_leaving_is_bounded_by_a_kill_and_what_survives_even_that_is_reported() -> None:
    ear = Ear()
    let_go = asyncio.Event()

    async def hang(message: Int32) -> None:
        await asyncio.sleep(1e6)

    async def resist(message: Int32) -> None:
        while not let_go.is_set():
            try:
                await let_go.wait()
            except asyncio.CancelledError:
                pass

    loop = asyncio.get_running_loop()
    for handler, seconds in ((hang, 5.0), (resist, 6.0)):
        begun = loop.time()
        async with open_node("listener", sinks=(ear,)) as node:
            node.on(NUMBERS, handler)
            node.publisher(NUMBERS)(number(1))
            await node.clock.sleep(0.0)
        assert loop.time() - begun == seconds
        assert system_here() is None
    (record,) = [record for record in ear.records if "refused to die" in record.event]
    assert record.fields == {"node_name": "/listener"}
    let_go.set()
    await asyncio.sleep(1.0)
    assert asyncio.all_tasks() == {asyncio.current_task()}


@pytest.mark.parametrize("stop", ["kill", 1.0, float("inf")])
async def test_a_guest_has_the_stop_timeout_of_its_declaration(rig: Rig, stop: Any) -> None:
    class Slow(Node):
        async def on_stop(self, reason: Any) -> None:
            await self.clock.sleep(8.0)

    await rig.start(Node)
    life = await rig.system.join(Child(Slow, stop=stop))
    assert repr(life) == "<joined node /slow>"
    await rig.system.leave(life)
    assert rig.now == {"kill": 0.0, 1.0: 1.0, float("inf"): 8.0}[stop]
    await rig.system.leave(life)  # twice is fine


@pytest.mark.parametrize("error", [OSError("no power"), Stop("not today"), None])
async def test_a_guest_that_does_not_start_fails_the_join_and_leaves_nothing(rig: Rig, error: Exception | None) -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            if error is not None:
                raise error
            incarnation_of(self).request_stop("at once")
            task = asyncio.current_task()
            assert task is not None
            task.cancel()
            await self.clock.sleep(60.0)

    await rig.start(Node)
    with pytest.raises(NotRunning if error is None else type(error)):
        await rig.system.join(Child(Broken))
    with pytest.raises(LookupError):
        rig.state("broken")


async def test_a_join_that_is_canceled_takes_its_node_back(rig: Rig) -> None:
    stopped: list[float] = []

    class Slow(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(60.0)

        async def on_stop(self, reason: Any) -> None:
            stopped.append(self.clock.now())

    await rig.start(Node)
    joining = asyncio.create_task(rig.system.join(Child(Slow)))
    await rig.advance(1.0)
    joining.cancel()
    await asyncio.wait([joining])
    assert stopped == [1.0]
    with pytest.raises(LookupError):
        rig.state("slow")


async def test_D2_a_stop_that_is_canceled_ends_every_node_in_order_and_leaves_none_behind() -> None:
    stopped: list[str] = []

    class Slow(Node):
        async def on_stop(self, reason: Any) -> None:
            await self.clock.sleep(60.0)
            stopped.append(self.name)

    system = create(System, sinks=(Ear(),))
    system.open()
    for name in ("first", "second"):
        await system.join(Child(Slow, name=name, stop=100.0))
    stopping = asyncio.create_task(system.stop())
    await asyncio.sleep(1.0)
    stopping.cancel()
    await asyncio.wait([stopping])
    assert stopping.cancelled()
    assert system.clock.now() == 120.0
    assert stopped == ["second", "first"]
    assert system.nodes == {}
    assert system_here() is None
    assert asyncio.all_tasks() == {asyncio.current_task()}


async def test_a_second_node_of_one_name_is_refused_and_the_first_goes_on() -> None:
    async with open_node("twin", sinks=()) as first:
        with pytest.raises(
            DeclarationError,
            match="a node named /twin is open already: give the second one another name= or namespace=",
        ):
            async with open_node("twin"):
                pass
        assert not incarnation_of(first).ended
        async with open_node("twin", namespace="/other") as second:
            assert second.fqn == "/other/twin"
    async with open_node("twin", sinks=()) as again:
        assert again.fqn == "/twin"


async def test_the_name_of_a_node_that_has_ended_by_itself_is_free_before_its_block_is_left() -> None:
    async with open_node("host", sinks=()):
        first = open_node("brief", sinks=())
        (await first.__aenter__()).stop("enough")
        await asyncio.sleep(0.1)
        async with open_node("brief", sinks=()) as second:
            with pytest.raises(Stop):
                await first.__aexit__(None, None, None)
            assert not incarnation_of(second).ended
            assert [state.identity.fqn for state in system_of(second).nodes.values()] == ["/host", "/brief"]
