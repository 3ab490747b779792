# pyright: reportPrivateUsage=false
"""Agents over real sockets with real certificates, and the interpreter that they keep ready."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from actors import Child, DeclarationError, Node
from actors.hosts import TlsHosts
from actors.hosts import launcher as launchers
from actors.hosts.agent import Agent
from actors.hosts.launcher import Launcher, transport_here
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
)
from actors.hosts.tls import _Caller, _end_with_certificate, address_of, serve
from actors.processes import os_process
from actors.processes.channel import Channel, framed
from actors.processes.messages import Line, Opaque, Order, Over, Ready, StopAsked
from actors.processes.pickling import pack, unpack
from actors.runtime.placement import Placement
from actors.transport.protocol import WireUnavailable
from actors.transport.security import SecurityError
from actors.transport.security.authority import read_certificate
from actors.transport.zenoh import ZenohTransport
from tests.actors.processes.kit import until
from tests.actors.transport.security.fleet import Fleet
from tests.facts import lacks

LEASE = 600.0
"""Long enough that the alarm of this process never goes off."""


class Quiet(Node):
    async def on_start(self) -> None:
        self.log.info("is quiet")


class Tree:
    """Keeps what an agent sends."""

    def __init__(self) -> None:
        self.got: list[Any] = []
        self.gone = asyncio.Event()

    def of(self, kind: type) -> list[Any]:
        return [value for value in self.got if isinstance(value, kind)]

    async def dial(self, hosts: TlsHosts, name: str = "base") -> Any:
        return await hosts.dial(name, self.got.append, self.gone.set)


@asynccontextmanager
async def agent(folder: Path, said: list[str]) -> AsyncGenerator[tuple[Fleet, Callable[..., TlsHosts]]]:
    """The agent of the base, which takes trees of the robot."""
    fleet = Fleet(folder, "robot", "base", "stranger")
    async with serve(
        "127.0.0.1", 0, owners=["robot"], security=fleet.security("base"), say=said.append, modules=["no.such.module"]
    ) as (at, port):

        def hosts(who: str = "robot", name: str = "base") -> TlsHosts:
            return TlsHosts({name: f"{at}:{port}"}, security=fleet.security(who), lease=LEASE)

        yield fleet, hosts


def order() -> Order:
    return Order(Child(Quiet, host="base"), ("top", "quiet"), 0, 20, None, transport_here, 0, placement=Placement(1, 3))


async def test_an_agent_launches_an_order_passes_on_what_is_said_and_stops_with_its_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    monkeypatch.setenv("ROBACTOR_GOSSIP_PORT", "0")
    said: list[str] = []
    tree = Tree()
    async with agent(tmp_path, said) as (_, hosts):
        wire = await tree.dial(hosts())
        wire.send(Hello(LEASE))
        await until(lambda: tree.of(LeaseRequest))
        wire.send(LeaseGrant(1))
        assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
        for number in (1, 2):  # the first one gets the interpreter that was ready, the second one waits for its own
            wire.send(Launch(number, ("top", "quiet"), 5.0, pack(order())))
        await until(lambda: sum(unpack(one.event) == Ready() for one in tree.of(ProcessEvent)) == 2)
        assert 0.5 * LEASE < signal.getitimer(signal.ITIMER_REAL)[0] <= 0.75 * LEASE + 0.2
        assert {one.number for one in tree.of(Launched)} == {1, 2}
        lines = [event for one in tree.of(ProcessEvent) if isinstance(event := unpack(one.event), Line)]
        assert "is quiet" in [line.event for line in lines]
        wire.send(ProcessRequest(1, pack(StopAsked("enough"))))
        await until(lambda: tree.of(ProcessEnded))
    await asyncio.wait_for(tree.gone.wait(), 30.0)

    assert tree.of(Leaving) == [Leaving()]
    assert [one.number for one in tree.of(ProcessEnded)] == [1, 2]
    overs = [event for one in tree.of(ProcessEvent) if isinstance(event := unpack(one.event), Over)]
    assert [str(over.reason) for over in overs] == ["it stopped: enough", "it stopped: the agent of its machine ends"]
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
    assert said[0] == "a tree of robot is connected"


async def test_who_is_no_owner_is_refused_and_the_wrong_machine_is_not_taken(tmp_path: Path) -> None:
    said: list[str] = []
    async with agent(tmp_path, said) as (_, hosts):
        stranger = Tree()
        wire = await stranger.dial(hosts("stranger"))
        wire.send(Hello(LEASE))
        await asyncio.wait_for(stranger.gone.wait(), 30.0)
        with pytest.raises(ConnectionError, match="is 'base', not 'spare', by its certificate"):
            await Tree().dial(hosts(name="spare"), "spare")

    assert stranger.got == []
    assert lacks(said[0], "stranger refused robot") == []


async def test_a_connection_ends_with_the_certificate_of_the_other_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    async with agent(tmp_path, said) as (fleet, hosts):
        ends = read_certificate(fleet.security("robot").tls.certificate).ends.timestamp()
        monkeypatch.setattr("actors.hosts.tls.time", SimpleNamespace(time=lambda: ends - 1.0))
        tree = Tree()
        wire = await tree.dial(hosts())
        wire.send(Hello(LEASE))
        await asyncio.wait_for(tree.gone.wait(), 30.0)
        monkeypatch.undo()
        await until(lambda: "the tree of robot is not connected any more" in said, f"the agent misses the tree: {said}")


async def test_an_agent_takes_no_word_without_a_certificate_of_the_fleet(tmp_path: Path) -> None:
    said: list[str] = []
    others = Fleet(tmp_path / "others", "robot")
    async with agent(tmp_path / "ours", said) as (_, hosts):
        address = hosts()
        other = TlsHosts({"base": "127.0.0.1:1"}, security=others.security("robot"))
        other._addresses = address._addresses  # type: ignore[attr-defined]
        with pytest.raises(OSError):
            await Tree().dial(other)
        reader, writer = await asyncio.open_connection(*address._addresses["base"])
        writer.write(b"GET / HTTP/1.0\r\n\r\n" + b"\0" * 1000)
        with pytest.raises((ConnectionError, asyncio.IncompleteReadError)):
            await reader.readexactly(1000)
        writer.close()

    assert said == []


@pytest.mark.parametrize("heard", [True, False])
async def test_what_comes_with_the_handshake_is_not_read_before_the_name_is_known(heard: bool) -> None:
    """A server may send data right behind its handshake: they are there when the connection is made."""
    read: list[bytes] = []

    class Ends:
        aborted = False

        def abort(self) -> None:
            self.aborted = True

    ends: Any = Ends()
    channel = Channel(lambda value: None, lambda: None, read.append, lambda transport: heard)
    channel.connection_made(ends)
    channel.data_received(framed("something"))

    assert (len(read), ends.aborted) == (int(heard), not heard)


@pytest.mark.parametrize("data", [framed("no message of an agent"), b"\xff\xff\xff\xff"], ids=["pickle", "long"])
async def test_bytes_that_are_no_message_end_the_connection(tmp_path: Path, data: bytes) -> None:
    said: list[str] = []
    async with agent(tmp_path, said) as (_, hosts):
        tree = Tree()
        wire = await tree.dial(hosts())
        wire._transport.write(data)
        await asyncio.wait_for(tree.gone.wait(), 30.0)
        again = Tree()
        (await again.dial(hosts())).send(Hello(LEASE))
        await until(lambda: again.of(LeaseRequest))


async def test_what_is_sent_by_who_was_refused_is_not_taken() -> None:
    async def launch(message: Launch, take: Callable[[Any], None]) -> Any:
        raise AssertionError("nothing is launched")

    caller = _Caller(Agent(launch), ["robot"])

    caller.channel.data_received(framed(Hello(LEASE)))
    caller.channel.connection_lost(None)


async def test_a_connection_that_is_being_closed_does_not_end_with_its_certificate_as_well() -> None:
    said: list[str] = []

    class Closing:
        def get_extra_info(self, name: str) -> dict[str, str]:
            return {"notAfter": "Jan  5 09:34:43 2018 GMT"}

        def is_closing(self) -> bool:
            return True

        def abort(self) -> None:
            said.append("aborted")

    closing: Any = Closing()
    _end_with_certificate(closing, lambda: said.append("the certificate has ended"))
    await asyncio.sleep(0)
    await asyncio.sleep(0)

    assert said == []


def test_mutual_tls_is_demanded(tmp_path: Path) -> None:
    fleet = Fleet(tmp_path, "robot")
    one_sided = fleet.security(
        "robot",
        tls={"authority": "authority.pem", "certificate": "certificate.pem", "key": "key.pem", "mutual": False},
    )

    with pytest.raises(SecurityError, match=r"agents need tls\.mutual"):
        TlsHosts({"base": "127.0.0.1:1"}, security=one_sided)


@pytest.mark.parametrize("lease", [0.0, -1.0, float("inf"), "3"])
def test_a_lease_is_a_number_of_seconds(tmp_path: Path, lease: Any) -> None:
    security = Fleet(tmp_path, "robot").security("robot")

    with pytest.raises(DeclarationError, match="the lease must be seconds, more than 0"):
        TlsHosts({"base": "127.0.0.1"}, security=security, lease=lease)


def test_addresses() -> None:
    assert address_of("192.168.1.6") == ("192.168.1.6", 7450)
    assert address_of("base.local:7000") == ("base.local", 7000)
    for wrong in (":7450", "base:", "base:seven", "base:70000"):
        with pytest.raises(DeclarationError, match="write ADDRESS:PORT"):
            address_of(wrong)


# What an agent gives its processes ---------------------------------------------------------------------------------------


def test_the_environment_says_how_the_nodes_of_an_agent_take_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "")
    monkeypatch.setenv(launchers.CONNECT, "tcp/127.0.0.1:1,tcp/127.0.0.1:2")
    monkeypatch.setenv(launchers.LISTEN, "")

    assert isinstance(transport_here(), ZenohTransport)

    monkeypatch.setenv(launchers.CONNECT, "nonsense")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "in_process")
    with pytest.raises(WireUnavailable, match="neither listens nor connects"):
        transport_here()
    monkeypatch.setenv(launchers.CONNECT, "")
    with pytest.raises(WireUnavailable, match="its processes reach nobody"):
        transport_here()


def test_what_only_passes_through_is_not_read_but_lines_are_told_apart() -> None:
    read = launchers._unread

    ready = pack(Ready())
    line = pack(Line(1.5, 20, "/a" * 40_000, 1, "hello", {"value": object}))
    assert read(ready) == Opaque(ready)
    assert read(line) == Opaque(line, line=True)


async def test_an_interpreter_that_has_died_while_it_waited_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    launcher = Launcher()
    await until(lambda: launcher._next)
    assert launcher._next is not None
    dead = launcher._next
    os.kill(dead.popen.pid, signal.SIGKILL)
    dead.popen.wait()

    process = await launcher.launch(Launch(1, ("top", "quiet"), 5.0, b"no order"), lambda event: None)

    assert process.id != dead.popen.pid
    process.kill()
    await process.ended
    launcher.close()


async def test_a_machine_that_can_start_nothing_says_so_to_the_child(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(name: str, *, fenced: bool) -> Any:
        raise OSError("no more processes")

    monkeypatch.setattr(os_process, "start", refuse)
    launcher = Launcher()
    await asyncio.sleep(0)

    with pytest.raises(OSError, match="no more processes"):
        await launcher.launch(Launch(1, ("top", "quiet"), 5.0, b"order"), lambda event: None)
    launcher.close()
