"""Where the client of a case is: beside its server in one system, or in another one that is joined with it by a transport.

`ask`, `rig` and `runner` are what checks use; without `over` they do everything in one system.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Protocol, TypeAlias, TypeVar, cast

from actors import Child, Node, QoS, Service, Topic
from actors.checks import create
from actors.contracts.contracts import Action
from actors.errors import GoalRejected
from actors.interfaces.message import Message
from actors.logs import DEBUG, LogRecord
from actors.system import System
from actors.testing import Rig, VirtualLoop
from actors.transport.bridge import connect
from actors.transport.protocol import Transport
from actors.transport.simulated.network import Network
from tests.conformance.client import FOUND_WITHIN, Client, Counted, Told, until

if TYPE_CHECKING:
    from tests.conformance.apart import ClientProcess

M = TypeVar("M", bound=Message)
Wire: TypeAlias = Literal["simulated", "zenoh", "dds"]
counts: Final = Counter[str]()
"""How many messages, calls and goals have crossed since `over` began."""
SETTLING: Final = 0.1


class Stage(Protocol):
    """What a check needs of a `Rig`."""

    @property
    def system(self) -> System: ...
    async def start(self, tree: Any, *more: Any) -> Any: ...
    async def advance(self, seconds: float) -> None: ...
    async def close(self) -> None: ...
    def probe(self, topic: Topic[M]) -> Any: ...
    async def call(self, service: Service[Any, Any], request: Any, *, timeout: float = ...) -> Any: ...
    def state(self, node: str) -> Any: ...


class Ear:
    """What a client has heard on a topic, as of the last `advance`."""

    def __init__(self, pair: Pair, number: int) -> None:
        self.messages: list[Any] = []
        self._pair = pair
        self.number = number
        self._taken = 0

    @property
    def last(self) -> Any:
        return self.messages[-1] if self.messages else None

    @property
    def received(self) -> int:
        return len(self.messages)

    async def next(self, *, timeout: float) -> Any:
        """The next message that has been heard."""
        self._taken += 1
        return self.messages[self._taken - 1]


class Pair:
    """Two systems: the nodes of `start` run in the first, and what the test does is done by the client in the second. See `Rig`."""

    def __init__(self, near: Transport, client: Told) -> None:
        self.logs: list[LogRecord] = []
        self.system = create(System, sinks=(self.logs.append,), level=DEBUG)
        connect(self.system.runtime, cast("Transport", Counted(near, counts)))
        self.client = client
        self.feedback: dict[bytes, int] = {}
        self._ears: list[Ear] = []
        self._deaf: list[tuple[Ear, Topic[Any], bool]] = []
        """The ears of which the client does not know yet."""

    async def start(self, tree: Any, *more: Any, client: str = "rig") -> list[Node]:
        """Run nodes in the first system, until both know each other. Returns them."""
        self.system.open()
        nodes = [(await self.system.join(Child(each))).node for each in (tree, *more)]
        await self.client.open(client)
        await self.system.runtime.opened()
        await until(lambda: {known.fqn for known in self.system.graph.elsewhere()} == {f"/{client}"})
        await self.client.wait_for_nodes({record.identity.fqn for record in self.system.nodes.values()})
        await asyncio.sleep(0.05)  # endpoints follow their nodes
        return nodes

    async def advance(self, seconds: float) -> None:
        await self.listen()
        await asyncio.sleep(seconds)
        await self._hear()

    async def listen(self) -> None:
        """Let the client listen with all ears."""
        while self._deaf:
            ear, topic, everything = self._deaf.pop(0)
            await self.client.listen(ear.number, topic, everything)

    async def _hear(self) -> None:
        news = await self.client.news()
        for number, messages in news.messages.items():
            self._ears[number].messages += messages
        self.feedback = news.feedback
        self.logs += [LogRecord(*line) for line in news.logs]
        counts.update(news.counts)

    def probe(self, topic: Topic[M]) -> Any:
        return self.ear(topic, everything=True)

    def subscribe(self, topic: Topic[M], *, qos: QoS | None = None) -> Ear:
        return self.ear(topic if qos is None else Topic(topic.type, topic.name, qos), everything=False)

    def ear(self, topic: Topic[Any], *, everything: bool) -> Ear:
        """One more listener in the client; it listens from the next `advance` on."""
        ear = Ear(self, len(self._ears))
        self._ears.append(ear)
        self._deaf.append((ear, topic, everything))
        return ear

    async def call(self, service: Service[Any, Any], request: Any, *, timeout: float = 2.0) -> Any:
        await self.listen()
        return await self.client.call(service, request, timeout)

    def state(self, node: str) -> Any:
        return self.system.runtime.directory.named(node)

    async def close(self) -> None:
        await self._hear()
        await self.client.close()
        await self.system.stop("the case is over")


class Sent:
    """A goal, as the client's handle shows it."""

    def __init__(self, untold: str, id: bytes, feedback: Callable[[], int]) -> None:
        self.untold = untold
        self.id = id
        self._feedback = feedback

    @property
    def feedback_count(self) -> int:
        return self._feedback()


async def send_goal(stage: Stage, action: Action[Any, Any, Any], message: Any) -> Sent:
    """Send a goal by a client's handle, and wait until it is accepted or not."""
    if isinstance(stage, Pair):
        sent = await stage.client.send_goal(action, message)
        return Sent(sent.untold, sent.id, lambda: stage.feedback.get(sent.id, 0))
    goal = cast("Rig", stage).me.send_goal(action, message)
    untold = goal.status.name.lower()
    with suppress(GoalRejected):
        await goal.send()
    return Sent(untold, goal.goal_id, lambda: goal.feedback_count)


class Meeting(NamedTuple):
    """A server's node, and what the client listens with."""

    stage: Rig | Pair
    server: Node
    client: Node | Pair

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
    (node,) = await pair.start(server, client=client.__name__.lower())
    return Meeting(pair, node, pair)


class _Over:
    """The transport over which cases are run, and the pair that answers `ask`, made when it is first needed."""

    def __init__(self, wire: Wire) -> None:
        self.loops: Callable[[], asyncio.AbstractEventLoop] = (
            VirtualLoop if wire == "simulated" else asyncio.new_event_loop
        )
        self._wire = wire
        self._runner = asyncio.Runner(loop_factory=self.loops)
        self._pair: Pair | None = None
        self.elsewhere: ClientProcess | None = None
        """Over a network, the process of the clients, made when it is first needed."""
        self._lines: dict[type[Message], tuple[Any, int]] = {}
        """For each type, the publisher by which messages are told, and the number of the listener."""
        self._answers: dict[Any, Callable[[Any], Any]] = {}

    def pair(self) -> Pair:
        if self._wire == "simulated":
            network = Network()
            hosts = ("server", "client")
            for host in hosts:
                network.add_host(host)
            return Pair(network.transport("server"), Client(network.transport("client")))
        from tests.actors.transport.dds.meeting import free_domain
        from tests.actors.transport.zenoh.wires import free_port
        from tests.conformance.apart import ClientProcess, Remote
        from tests.conformance.elsewhere import transport_at

        self.elsewhere = self.elsewhere or ClientProcess()
        place = free_domain() if self._wire == "dds" else free_port()
        return Pair(transport_at(self._wire, place), Remote(self.elsewhere, place, self._wire))

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
            publisher, number = teller.publisher(topic), pair.ear(topic, everything=False).number
            await pair.listen()
            await until(lambda: publisher.subscription_count)
            await pair.client.wait_for_publisher(number)
            self._lines[kind] = publisher, number
        publisher, number = self._lines[kind]
        publisher.publish(message)
        told: M = await pair.client.next(number)
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
        return await pair.call(service, request, timeout=FOUND_WITHIN)

    def close(self) -> None:
        if self._pair is not None:
            self._runner.run(self._pair.close())
        self._runner.close()
        if self.elsewhere is not None:
            self.elsewhere.close()


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
