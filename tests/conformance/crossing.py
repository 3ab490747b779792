"""Where the client of a case is: beside its server in one system, or in another one that is joined with it by a transport.

`ask`, `rig` and `runner` are what checks use; without `over` they do everything in one system.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, Literal, NamedTuple, Protocol, TypeAlias, TypeVar, cast

from actors import Child, Node, Service, Topic
from actors.interfaces.message import Message
from actors.logs import DEBUG, LogRecord
from actors.qos import of
from actors.runtime.incarnation import incarnation_of
from actors.system import System
from actors.testing import Probe, Rig, VirtualLoop
from actors.transport.bridge import connect
from actors.transport.protocol import Transport
from actors.transport.simulated.network import Network

__all__ = ["Meeting", "Pair", "Stage", "Wire", "ask", "counts", "delay", "meet", "over", "rig", "runner", "tell"]

M = TypeVar("M", bound=Message)
Wire: TypeAlias = Literal["simulated", "zenoh"]
counts: Final = Counter[str]()
"""How many messages, calls and goals have crossed since `over` began."""
_NOT_COUNTED: Final = ("/rosout/", "/parameter_events/")
SETTLING: Final = 0.1
FOUND_WITHIN: Final = 10.0
"""Seconds in which two systems have to find each other."""


class Stage(Protocol):
    """What a check needs of a `Rig`."""

    @property
    def me(self) -> Node: ...
    @property
    def system(self) -> System: ...
    async def start(self, tree: Any, *more: Any) -> Any: ...
    async def advance(self, seconds: float) -> None: ...
    async def close(self) -> None: ...
    def probe(self, topic: Topic[M]) -> Probe[M]: ...
    async def call(self, service: Service[Any, Any], request: Any, *, timeout: float = ...) -> Any: ...
    def state(self, node: str) -> Any: ...


class _Counted:
    """A transport that counts what arrives."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def subscribe(self, key: str, delivery: Any, take: Callable[[Any], None]) -> Any:
        def counted(sample: Any) -> None:
            counts["messages"] += not any(name in f"/{key}" for name in _NOT_COUNTED)
            take(sample)

        return self._transport.subscribe(key, delivery, counted)

    def serve(self, key: str, take: Callable[[Any], None]) -> Any:
        def counted(query: Any) -> None:
            counts["goals" if "/_action/send_goal/" in key else "calls"] += 1
            take(query)

        return self._transport.serve(key, counted)


class Pair:
    """Two systems: the nodes of `start` run in the first, and what the test does is done by a node of the second. See `Rig`."""

    def __init__(self, near: Transport, far: Transport) -> None:
        self.logs: list[LogRecord] = []
        self.system = self._system(near)
        self.far = self._system(far)
        self._me: Any = None

    def _system(self, transport: Transport) -> System:
        system = System(sinks=(self.logs.append,), level=DEBUG)
        connect(system.runtime, cast("Transport", _Counted(transport)))
        return system

    @property
    def me(self) -> Node:
        node: Node = self._me.node
        return node

    async def start(self, tree: Any, *more: Any) -> list[Node]:
        """Run nodes in the first system, until both know each other. Returns them."""
        for system in (self.system, self.far):
            system.open()
        nodes = [(await self.system.join(Child(each))).node for each in (tree, *more)]
        self._me = await self.far.join(Child(Node, name="rig"))
        for system in (self.system, self.far):
            await system.runtime.opened()
        await self.until(lambda: self._sees(self.far, self.system) and self._sees(self.system, self.far))
        return nodes

    @staticmethod
    def _sees(one: System, other: System) -> bool:
        seen = {known.fqn for known in one.graph.elsewhere()}
        return seen == {record.identity.fqn for record in other.nodes.values()}

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(FOUND_WITHIN):
            while not condition():
                await asyncio.sleep(0.01)
        await asyncio.sleep(0.05)  # endpoints follow their nodes

    async def advance(self, seconds: float) -> None:
        await asyncio.sleep(seconds)

    def probe(self, topic: Topic[M]) -> Probe[M]:
        me = incarnation_of(self.me)
        entry = self.far.graph.topic(me.identity.topic(topic.name))
        probe = Probe(me, entry, topic.type, of(topic.qos), self.far.clock.now)
        me.streams.append(cast("Any", probe))
        entry.add_subscription(probe)
        return probe

    async def call(self, service: Service[Any, Any], request: Any, *, timeout: float = 2.0) -> Any:
        return await self.me.call(service, request, timeout=timeout)

    def state(self, node: str) -> Any:
        return self.system.runtime.directory.named(node)

    async def close(self) -> None:
        for system in (self.far, self.system):
            await system.stop("the case is over")


class Meeting(NamedTuple):
    """A server's node and a client's, and where they run."""

    stage: Rig | Pair
    server: Node
    client: Node

    async def settle(self) -> None:
        """Let the other one learn of it."""
        await self.stage.advance(delay())


async def meet(server: type[Node], client: type[Node]) -> Meeting:
    """Run two nodes of these classes."""
    if not _over:
        rig = Rig()
        await rig.start(server, client)
        return Meeting(rig, rig.node(server), rig.node(client))
    pair = _over[-1].pair()
    (node,) = await pair.start(server)
    return Meeting(pair, node, (await pair.far.join(Child(client))).node)


class _Over:
    """The transport over which cases are run, and the pair that answers `ask`, made when it is first needed."""

    def __init__(self, wire: Wire) -> None:
        self.loops: Callable[[], asyncio.AbstractEventLoop] = (
            VirtualLoop if wire == "simulated" else asyncio.new_event_loop
        )
        self._wire = wire
        self._runner = asyncio.Runner(loop_factory=self.loops)
        self._pair: Pair | None = None
        self._lines: dict[type[Message], tuple[Any, Any]] = {}
        """For each type, the publisher and the stream by which messages are told."""
        self._answers: dict[Any, Callable[[Any], Any]] = {}

    def pair(self) -> Pair:
        if self._wire == "simulated":
            network = Network()
            hosts = ("server", "client")
            for host in hosts:
                network.add_host(host)
            return Pair(network.transport("server"), network.transport("client"))
        from tests.actors.transport.zenoh.wires import PeerWire

        wire = PeerWire()
        return Pair(wire.transport(), wire.transport())

    def ask(self, type: Any, answer: Callable[[Any], Any], request: Any) -> Any:
        return self._runner.run(self._ask(type, answer, request))

    def tell(self, message: M) -> M:
        return self._runner.run(self._tell(message))

    async def _tell(self, message: M) -> M:
        pair = await self._opened()
        kind = type(message)
        if kind not in self._lines:
            topic = Topic(kind, f"/told/{kind.__name__}")
            teller = (await pair.system.join(Child(Node, name=f"teller_of_{kind.__name__.lower()}"))).node
            publisher, heard = teller.publisher(topic), pair.me.subscribe(topic)
            await pair.until(lambda: bool(publisher.subscription_count and heard.publisher_count))
            self._lines[kind] = publisher, heard
        publisher, heard = self._lines[kind]
        publisher.publish(message)
        told: M = await heard.next(timeout=FOUND_WITHIN)
        return told

    async def _opened(self) -> Pair:
        if self._pair is None:
            self._pair = self.pair()
            await self._pair.start(Node)
        return self._pair

    async def _ask(self, type: Any, answer: Callable[[Any], Any], request: Any) -> Any:
        pair, name = await self._opened(), f"asked/{type.__name__}"
        service = Service(type, f"/{name}")
        known = type in self._answers
        self._answers[type] = answer
        if not known:
            await pair.system.join(Child(_server_of(service, self._answers), name=f"server_of_{type.__name__.lower()}"))
        await pair.me.wait_for(service, timeout=FOUND_WITHIN)
        return await pair.call(service, request, timeout=FOUND_WITHIN)

    def close(self) -> None:
        if self._pair is not None:
            self._runner.run(self._pair.close())
        self._runner.close()


def _server_of(service: Service[Any, Any], answers: dict[Any, Callable[[Any], Any]]) -> type[Node]:
    """A node that serves with the newest of the answers to this type."""

    class Server(Node):
        @service.serve()
        async def answer(self, request: Any) -> Any:
            return answers[service.type](request)

    return Server


_over: list[_Over] = []


@contextmanager
def over(wire: Wire | None) -> Iterator[None]:
    """Within the block, clients are joined with their servers by a transport; without one, by nothing."""
    if wire is None:
        yield
        return
    counts.clear()
    _over.append(_Over(wire))
    try:
        yield
    finally:
        _over.pop().close()


def runner() -> asyncio.Runner:
    """A runner for one case."""
    return asyncio.Runner(loop_factory=_over[-1].loops if _over else VirtualLoop)


def delay() -> float:
    """How long, in seconds, what a server does may take to be known to its client, and the reverse."""
    return SETTLING if _over else 0.0


def rig() -> Stage:
    """What runs the nodes of a case, and does what its script says."""
    return _over[-1].pair() if _over else Rig()


def ask(type: Any, answer: Callable[[Any], Any], request: Any) -> Any:
    """What `answer`, a service of `type`, says to a request."""
    return _over[-1].ask(type, answer, request) if _over else answer(request)


def tell(message: M) -> M:
    """A message as it arrives."""
    return _over[-1].tell(message) if _over else message
