"""Children that come and go while the system runs: what is left of them, and what others notice."""

from __future__ import annotations

from typing import Any

import pytest

from actors import (
    Action,
    Child,
    Done,
    DynamicSupervisor,
    Node,
    Service,
    Steps,
    Supervisor,
    Topic,
    every,
    parameter,
    publishes,
    subscribes,
    temporary,
)
from actors.errors import NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos import ROSOUT
from actors.runtime.incarnation import incarnation_of
from actors.supervision.running import RunningSupervisor
from actors.testing import Rig
from tests.stage import ADD, NUMBERS, number, total, two

OWN_NUMBERS, OWN_WORDS, MISFIT = Topic(Int32, "~/numbers"), Topic(String, "~/words"), Topic(String, "/numbers")
OWN_ADD, OWN_COUNT = Service(AddTwoInts, "~/add"), Action(Fibonacci, "~/count")


class Office(Node):
    """Stays; takes what everybody sends, and serves everybody."""

    async def on_start(self) -> None:
        self.sum = 0

    @NUMBERS.on()
    def take(self, message: Int32) -> None:
        self.sum += message.data

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)


class Worker(Node):
    """Has everything of its own, and uses what is common."""

    out = publishes(NUMBERS)
    own_out = publishes(OWN_NUMBERS)
    heard = subscribes(OWN_WORDS)
    speed = parameter(0.5)

    async def on_start(self) -> None:
        await self.call(ADD, two(1, 2))
        async with self.subscribe(MISFIT) as stream:
            assert stream.publisher_count == 0
        self.publisher(Topic(Int32, f"results_of_{self.name}"))(number(1))
        self.out(number(1))

    @OWN_WORDS.on()
    async def listen(self, message: String) -> None: ...

    @OWN_ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a * request.b)

    @OWN_COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(Fibonacci.Result())

    @every(hz=10)
    def tick(self) -> None: ...


def sizes(rig: Rig) -> dict[str, int]:
    """How much the registries of the system hold."""
    system = rig.system
    graph = system.graph
    found: dict[str, Any] = {
        "nodes": system.nodes,
        "names": system.runtime.directory._paths,  # pyright: ignore[reportPrivateUsage]
        "topics": graph.topics,
        "services": graph.services,
        "actions": graph.actions,
        "publishers": [one for topic in graph.topics.values() for one in topic.publishers],
        "subscriptions": [one for topic in graph.topics.values() for one in topic.subscriptions],
        "mismatches": [pair for topic in graph.topics.values() for pair in topic.mismatches],
        "clients": [one for entry in graph.services.values() for one in entry.clients],
        "goals": [one for entry in graph.actions.values() for one in entry.clients],
        "ticks": [entry for entry in system.runtime.ticker._heap if not entry[3].canceled],  # pyright: ignore[reportPrivateUsage]
    }
    return {name: len(held) for name, held in found.items()}


def workers(rig: Rig) -> RunningSupervisor:
    root = rig.system.supervisor
    assert root is not None
    life = root.life("workers")
    assert isinstance(life, RunningSupervisor)
    return life


async def start(rig: Rig) -> None:
    pool = DynamicSupervisor("workers", Child(Worker, restart=temporary))
    await rig.start(Supervisor("system", children=[Child(Office), pool]))


@pytest.mark.slow(reason="a thousand children")
async def test_a_thousand_children_that_have_ended_leave_nothing_behind(rig: Rig) -> None:
    await start(rig)
    pool = workers(rig)
    before = sizes(rig)
    for _ in range(10):
        children = [await pool.spawn() for _ in range(100)]
        assert sizes(rig)["nodes"] == before["nodes"] + 100
        await rig.advance(0.25)
        for child in children:
            assert child is not None
            await pool.terminate_child(child)
    assert sizes(rig) == before
    await rig.settled()
    assert rig.node(Office).sum == 1000
    assert rig.system.graph.topic("/numbers").message_count == 1000


async def test_nor_do_those_that_ended_by_themselves_failed_or_were_stopped_together(rig: Rig) -> None:
    await start(rig)
    before = sizes(rig)
    for name in ("done", "broken", "left"):
        await workers(rig).spawn(name=name)
    done = rig.state("done").running
    assert done is not None
    done.node.stop("has done its work")
    rig.crash("broken", OSError("encoder"))
    await rig.settled()
    assert sizes(rig)["nodes"] == before["nodes"] + 1
    root = rig.system.supervisor
    assert root is not None
    await root.terminate_child("workers")
    assert sizes(rig) == before


async def test_a_child_that_was_added_is_forgotten_with_its_supervisor_s_entry(rig: Rig) -> None:
    await start(rig)
    root = rig.system.supervisor
    assert root is not None
    before = sizes(rig)
    await root.start_child(Child(Worker, name="temp", restart=temporary))
    await root.terminate_child("temp")
    assert sizes(rig) == before
    await root.start_child(Child(Worker, name="kept"))
    await root.terminate_child("kept")
    assert rig.state("kept").state == "stopped"


async def test_who_asks_for_an_ended_child_hears_at_once_that_it_has_stopped(rig: Rig) -> None:
    await start(rig)
    pool = workers(rig)
    await pool.spawn(name="worker")
    known, unknown = Service(AddTwoInts, "worker/add"), Service(AddTwoInts, "worker/add")
    assert (await rig.call(known, two(3, 4))).sum == 12
    await pool.terminate_child("worker")
    for service in (known, unknown):
        with pytest.raises(NotRunning, match="/worker, which served /worker/add, has stopped"):
            await rig.call(service, two(3, 4))
    await pool.spawn(name="worker")
    assert (await rig.call(known, two(5, 6))).sum == 30
    assert rig.now == 0.0


async def test_who_calls_a_name_that_has_come_back_is_a_client_of_the_new_one(rig: Rig) -> None:
    await start(rig)
    service = Service(AddTwoInts, "worker/add")
    for _ in range(2):
        child = await workers(rig).spawn(name="worker")
        assert child is not None
        assert (await rig.call(service, two(3, 4))).sum == 12
        (view,) = [one for one in rig.system.snapshot().services if one.name == "/worker/add"]
        assert (view.server, view.clients, view.calls) == ("/worker", (rig.me.fqn,), 1)
        await workers(rig).terminate_child(child)


async def test_who_listens_to_the_logs_hears_them_after_another_listener_has_come_and_gone(rig: Rig) -> None:
    class Listener(Node):
        logs = subscribes(Topic(Log, "/rosout", ROSOUT))

    listeners = DynamicSupervisor("workers", Child(Listener, restart=temporary))
    await rig.start(Supervisor("system", children=[Child(Office), listeners]))
    for _ in range(2):
        child = await workers(rig).spawn()
        assert child is not None
        rig.node(Office).log.info("open")
        heard = await rig.node(Listener).logs.next(timeout=1.0)
        assert (heard.name, heard.msg) == ("office", "open")
        await workers(rig).terminate_child(child)


async def test_a_client_of_many_short_lived_services_remembers_the_newest_only(rig: Rig) -> None:
    await start(rig)
    pool = workers(rig)
    for index in range(300):
        child = await pool.spawn(name=f"worker_{index}")
        assert child is not None
        await rig.call(Service(AddTwoInts, f"worker_{index}/add"), two(2, 3))
        await pool.terminate_child(child)
    assert len(rig.system.graph.services) < 10
    assert len(rig.system.graph.departed) <= 256
    assert len(incarnation_of(rig.me).endpoints.clients) <= 256


class Choking(Node):
    """Fails at the first number, and leaves the others lying."""

    @NUMBERS.on()
    def take(self, message: Int32) -> None:
        raise ValueError("too much")


class Deaf(Node):
    """Takes nothing."""


async def test_what_waited_for_a_life_that_never_came_is_counted_as_dead_letters(rig: Rig) -> None:
    tree = Supervisor("office", children=[Child(Office), Child(Choking, restart=temporary)])
    system = await rig.start(tree)
    with rig.expect_failure(ValueError):
        for k in range(4):
            rig.publish(NUMBERS, number(k))
        await rig.advance(1.0)
    assert system.dead_letters == 3
    assert rig.node(Office).sum == 6
    (line,) = [record for record in rig.logs if record.event == "dead letters"]
    assert line.fields == {"node_name": "/choking", "messages": 3}


async def test_what_waited_for_a_handler_that_the_next_life_has_not_is_a_dead_letter_too(rig: Rig) -> None:
    system = await rig.start(Supervisor("office", children=[Child(Office), Child(Choking)]))
    assert isinstance(system.supervisor, RunningSupervisor)
    for k in range(3):
        rig.publish(NUMBERS, number(k))
    await system.supervisor.replace("choking", Deaf)
    assert system.dead_letters == 3
    (line,) = [record for record in rig.logs if record.event == "dead letters"]
    assert line.fields == {"node_name": "/choking", "messages": 3}
