"""The tree's side: one host, with an agent that does what the test says."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from actors import Child, Node
from actors.errors import ProcessDied
from actors.hosts.host import Host, HostLost
from actors.hosts.launcher import transport_here
from actors.hosts.messages import (
    Hello,
    Launch,
    Launched,
    LeaseGrant,
    LeaseRequest,
    Leaving,
    ProcessEnded,
    ProcessEvent,
    ProcessRequest,
    Signaled,
    Watched,
)
from actors.hosts.placing import Placing
from actors.hosts.remote import RemoteProcess
from actors.processes.messages import CrashAsked, Event, Line, NodeFacts, Nodes, Order, Over, Ready, StopAsked
from actors.processes.pickling import pack, unpack
from actors.supervision.reasons import Failed, Stopped
from tests.actors.supervision.kit import settle, virtual

LEASE = 4.0


class Idle(Node):
    pass


class Log:
    def __init__(self) -> None:
        self.lines: list[tuple[str, dict[str, object]]] = []

    def info(self, event: str, **fields: object) -> None:
        self.lines.append((event, fields))

    warning = error = info

    def events(self) -> list[str]:
        return [event for event, _ in self.lines]


class Wire:
    """What the tree sends, and whether it has closed the connection."""

    unsent = 0

    def __init__(self, take: Callable[[Any], None], lost: Callable[[], None]) -> None:
        self.take, self.lost = take, lost
        self.sent: list[Any] = []
        self.closed = False

    def send(self, value: object) -> None:
        self.sent.append(value)

    def close(self) -> None:
        self.closed = True

    def of(self, kind: type) -> list[Any]:
        return [value for value in self.sent if isinstance(value, kind)]

    def renew(self, number: int = 1, at: float = 0.0, left: float = 3.0) -> None:
        self.take(LeaseRequest(number, at, left))


class Stage:
    """A host, and the wires that it has opened; `problem` is raised instead."""

    def __init__(self) -> None:
        self.log: Any = Log()
        self.wires: list[Wire] = []
        self.problem: OSError | None = None
        self.before_it_is_known: Callable[[Wire], None] = lambda wire: None
        self.names, self.lease = ("base",), LEASE
        self.events: list[Event] = []

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None]) -> Any:
        assert host == "base"
        if self.problem is not None:
            raise self.problem
        wire = Wire(take, lost)
        self.wires.append(wire)
        self.before_it_is_known(wire)
        return wire

    def count_run(self) -> int:
        return 1

    def host(self) -> Host:
        return Host("base", LEASE, self.dial, self.log)

    def process(self, host: Host, **order: Any) -> RemoteProcess:
        made = Order(Child(Idle, host="base"), ("top", "idle"), 0, 20, None, transport_here, 0, **order)
        process = RemoteProcess(made, self.events.append)
        host.launch(process, made)
        return process


@virtual
async def test_a_host_is_usable_once_its_agent_holds_a_lease_and_as_long_as_it_is_heard() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    (wire,) = stage.wires
    assert wire.sent == [Hello(LEASE)]
    assert not host.tried

    wire.renew(1, left=0.0)
    await settle()
    assert (host.tried, host.usable) == (False, False)
    wire.renew(2)
    await settle()
    assert (host.tried, host.usable) == (True, True)
    assert wire.of(LeaseGrant) == [LeaseGrant(1), LeaseGrant(2)]
    assert stage.log.lines == [("a host is connected", {"host": "base"})]

    await asyncio.sleep(2.1)
    assert not host.usable
    wire.renew(3, left=0.9)  # it has not heard the tree for long
    assert not host.usable
    await host.close()
    assert wire.closed


@virtual
async def test_a_host_that_cannot_be_reached_is_tried_again_and_named_once() -> None:
    stage = Stage()
    stage.problem = ConnectionRefusedError("refused")
    host = stage.host()
    await asyncio.sleep(3.0)
    assert host.tried
    assert stage.log.lines == [
        ("a host cannot be reached", {"host": "base", "because": "ConnectionRefusedError: refused"})
    ]

    stage.problem = None
    await asyncio.sleep(0.2)
    stage.wires[0].renew()
    await settle()
    assert host.usable
    await host.close()


@virtual
async def test_an_agent_that_says_nothing_or_ends_the_connection_does_not_count_as_reached() -> None:
    stage = Stage()
    host = stage.host()
    await asyncio.sleep(1.1)
    assert stage.wires[0].closed
    assert stage.log.lines == [("a host cannot be reached", {"host": "base", "because": "it does not answer"})]

    await asyncio.sleep(0.2)
    stage.wires[1].lost()
    stage.before_it_is_known = lambda wire: wire.lost()
    await asyncio.sleep(0.3)
    assert len(stage.wires) == 3
    assert stage.wires[2].sent == []
    assert not host.usable
    await host.close()


@virtual
async def test_a_lost_host_ends_its_processes_when_its_lease_is_over_and_not_before() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    (wire,) = stage.wires
    wire.renew()
    await settle()
    process = stage.process(host)
    wire.take(Launched(1, 4711))
    assert process.id == 4711

    wire.lost()  # an agent that was killed: what it has launched may still act
    assert not host.usable
    process.send(StopAsked("too late"))
    await asyncio.sleep(LEASE - 0.01)
    assert not process.ended.done()
    await asyncio.sleep(0.02)

    lost = process.ended.result()
    assert isinstance(lost, HostLost)
    assert (lost.host, lost.seconds) == ("base", LEASE)
    assert stage.log.lines[-1] == ("a host is lost", {"host": "base", "processes": 1})
    assert len(stage.wires) == 2


@virtual
async def test_what_still_comes_from_a_connection_that_was_given_up_is_ignored() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    old = stage.wires[0]
    old.renew()
    await settle()
    stage.process(host)
    await asyncio.sleep(LEASE + 0.1)
    new = stage.wires[1]
    new.renew()
    await settle()

    old.renew(2)
    old.take(ProcessEvent(1, pack(Ready())))
    old.lost()

    assert old.of(LeaseGrant) == [LeaseGrant(1)]
    assert stage.events == []
    assert host.usable
    await host.close()


@virtual
async def test_what_a_process_tells_and_nobody_can_read_is_logged_and_what_follows_is_heard() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    (wire,) = stage.wires
    wire.renew()
    await settle()
    stage.process(host)

    wire.take(ProcessEvent(1, b"no event"))
    wire.take(ProcessEvent(1, pack(Ready())))

    assert stage.events == [Ready()]
    event, fields = stage.log.lines[-1]
    assert (event, fields["host"]) == ("what a process tells cannot be read", "base")
    await host.close()


@virtual
async def test_an_agent_that_leaves_gets_nothing_more_and_is_not_mourned() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    (wire,) = stage.wires
    wire.renew()
    await settle()
    process = stage.process(host)

    wire.take(Leaving())
    assert not host.usable
    wire.take(ProcessEnded(1, ProcessDied(7, "exit code 0")))
    assert str(process.ended.result()) == "process 7 has ended: exit code 0"
    wire.take(ProcessEvent(1, pack(Ready())))
    wire.lost()
    await asyncio.sleep(LEASE + 0.1)

    assert stage.events == []
    assert "a host is lost" not in stage.log.events()
    assert len(stage.wires) == 2
    await host.close()


@virtual
async def test_times_are_those_of_each_machine() -> None:
    """The clock of the agent is 1000 s behind."""
    stage = Stage()
    host = stage.host()
    await settle()
    now = asyncio.get_running_loop().time()
    (wire,) = stage.wires
    wire.renew(1, at=now - 1000.0)
    wire.renew(2, at=now - 1000.5)  # a message that took longer
    await settle()
    child = Child(Idle, host="base")
    facts = NodeFacts(("top", "idle"), child, "running", 2, restarts=((now - 10.0, "it failed"),))
    stage.process(host, nodes=(facts, NodeFacts(("top", "other"), child, "running", 1)))

    order = unpack(wire.of(Launch)[0].order)
    assert order.nodes[0].restarts == ((now - 1010.0, "it failed"),)
    wire.take(ProcessEvent(1, pack(Line(now - 1000.0, 20, "/idle", 1, "hello", {}))))
    wire.take(ProcessEvent(1, pack(Nodes(order.nodes))))
    wire.take(ProcessEvent(1, pack(Ready())))

    line, nodes, ready = stage.events
    assert isinstance(line, Line)
    assert line.at == now
    assert isinstance(nodes, Nodes)
    assert nodes.changed[0].restarts == ((now - 10.0, "it failed"),)
    assert ready == Ready()
    await host.close()


@virtual
async def test_what_is_asked_of_a_process_goes_to_its_agent() -> None:
    stage = Stage()
    host = stage.host()
    await settle()
    (wire,) = stage.wires
    wire.renew()
    await settle()
    process = stage.process(host)
    crash = CrashAsked(("top", "idle"), OSError("x"))
    process.watch()
    process.send(StopAsked("enough"))
    process.unwatch()
    process.terminate()
    process.kill()
    process.send(crash)

    assert wire.sent[-6:-1] == [
        Watched(1, True),
        ProcessRequest(1, pack(StopAsked("enough"))),
        Watched(1, False),
        Signaled(1, False),
        Signaled(1, True),
    ]
    assert unpack(wire.sent[-1].request).path == ("top", "idle")
    assert repr(process) == "<remote process 0 of top/idle>"
    await host.close()


@pytest.mark.parametrize("end", ["stop", "kill", "terminate"])
@virtual
async def test_a_process_that_nobody_has_taken_yet_ends_as_soon_as_it_is_asked_to(end: str) -> None:
    stage = Stage()
    order = Order(Child(Idle, host="base"), ("top", "idle"), 0, 20, None, transport_here, 0)
    stage.problem = ConnectionRefusedError("refused")
    placing = Placing(stage, stage.log, 1)
    process = await placing.launch(order, stage.events.append)
    process.watch()
    process.unwatch()
    process.send(CrashAsked(("top", "idle"), OSError("nobody is there")))
    await asyncio.sleep(1.0)
    assert stage.events == []

    if end == "stop":
        process.send(StopAsked("enough"))
        process.send(StopAsked("again"))
    else:
        getattr(process, end)()
        getattr(process, end)()

    assert str(process.ended.result()) == "process 0 has ended: no machine had taken it yet"
    assert stage.events == ([Over(Stopped("enough"))] if end == "stop" else [])
    await asyncio.sleep(1.0)
    assert stage.wires == []
    await placing.close()


@virtual
async def test_an_order_that_cannot_be_copied_is_a_failed_start() -> None:
    stage = Stage()
    values: list[object] = []
    order = Order(Child(Idle, args=(values,), host="base"), ("top", "idle"), 0, 20, None, transport_here, 0)
    values.append(asyncio.get_running_loop())
    placing = Placing(stage, stage.log, 1)
    process = await placing.launch(order, stage.events.append)
    await settle()
    stage.wires[0].renew()
    await asyncio.sleep(0.1)

    (over,) = stage.events
    assert isinstance(over, Over)
    assert isinstance(over.reason, Failed)
    assert process.ended.done()
    await placing.close()


@virtual
async def test_a_tree_that_ends_while_a_child_waits_for_a_host_lets_go() -> None:
    stage = Stage()
    placing = Placing(stage, stage.log, 1)
    order = Order(Child(Idle, host="base"), ("top", "idle"), 0, 20, None, transport_here, 0)
    await placing.launch(order, stage.events.append)
    await settle()

    await placing.close()
    await asyncio.sleep(10.0)

    assert len(stage.wires) == 1
