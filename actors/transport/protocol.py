"""The Protocol of a transport: the nodes and endpoints of one process in a domain of ROS 2, and those of the other processes.

`actors.transport.bridge` connects a transport with the graph of a system, so that everything about matching, queues, QoS events and calls is
done once, above this Protocol. `actors.transport.keyed` makes a transport of keys and bytes, such as Zenoh, one of these, in the format of
``rmw_zenoh``; `actors.transport.dds` speaks the wire of ``rmw_cyclonedds``.

**Calls.** All methods and all callbacks run on the event loop's thread. No method but `join` and `close` waits. None raises because of
the network: what cannot be sent is lost, as its quality of service permits, and counted in `report`. Methods that take a name raise
`WireFormatError` if the wire cannot represent it. No callback is called from within a method; callbacks come from the loop, and must not
raise. After the `close` of a handle its callback is not called again.

**Order.** The messages of one publisher reach one subscription in the order of their `put`, each at most once. `Events.appeared` comes before
`Events.vanished` for an endpoint, each once in its life. A message may arrive before its publisher has appeared.

**Own traffic.** What this process has does not appear to itself, and what it sends does not come back.

**Loss of a process.** When a process has ended, has been cut off, or is silent for longer than its lease, its endpoints vanish, then its nodes, and
then the questions that only it could answer end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Protocol, TypeAlias, runtime_checkable

from actors.qos.policies import QoS
from actors.transport.format.tokens import EndpointKind

PATIENCE: Final = 1 / 60
"""For how long a message may wait for others that is shown to somebody, in seconds: one picture of a screen."""


def next_look(now: float, patience: float = PATIENCE) -> float:
    """When messages that may wait so long are looked at next: at whole multiples of it, in seconds on the loop's clock."""
    return (math.floor(now / patience) + 1) * patience


class WireUnavailable(Exception):
    """The transport cannot be opened; the text is one line that says why and what to do. The local system can go on without it."""


class TypeInfo(NamedTuple):
    """What a transport must know of a type."""

    name: str
    """``package/kind/Name``; for the parts of an action ``package/action/Name_SendGoal`` and so on."""
    hash: str
    """``RIHS01_`` and 64 hex digits."""
    bulk: bool = False
    """Messages may be as large as what they contain: an image, a cloud of points. They let all others pass."""
    buffers: bool = False
    """It has an unbounded ``uint8[]`` field, which newer distributions of ROS 2 send apart; see `actors.transport.format.buffers`."""


class RemoteNode:
    """A node of another process. For the graph it is the node of its endpoints."""

    def __init__(self, fqn: str, session: str, number: int, domain_id: int, *, checks_qos: bool = True) -> None:
        self.fqn = fqn
        """Its full name."""
        self.session = session
        """The identity of its process on the network."""
        self.number = number
        self.domain_id = domain_id
        self.checks_qos = checks_qos
        """Whether endpoints of this node exchange nothing if what one requests exceeds what the other offers, as in DDS."""

    def __repr__(self) -> str:
        return f"<node {self.fqn} of {self.session}>"

    @property
    def identity(self) -> tuple[str, int]:
        """What distinguishes it from all other nodes, also from those of its name."""
        return self.session, self.number

    def warn(self, event: str, **fields: object) -> None:
        """Do nothing: its own process logs the same."""


class RemoteEndpoint(NamedTuple):
    """An endpoint of another process."""

    node: RemoteNode
    kind: EndpointKind
    name: str
    """The full name of its topic or service."""
    type: str
    type_hash: str
    qos: QoS
    gid: bytes
    """What identifies it on the network, 16 bytes."""
    number: int = 0
    """By which the endpoints of a process are listed."""
    alive: Callable[[], bool] | None = None
    """Whether a publisher with MANUAL_BY_TOPIC is alive, where the wire judges that; None: its messages show it."""


class Replied(NamedTuple):
    """A request was answered."""

    payload: bytes
    extension: bytes
    """What this library adds to a reply; empty from others."""


@dataclass(frozen=True, slots=True)
class Failed:
    """A request was answered with an error."""

    payload: bytes


@dataclass(frozen=True, slots=True)
class NoAnswer:
    """A request was not answered: nobody serves it, who served it has gone or dropped it, or its time is over."""

    timed_out: bool
    """Whether its time is over; otherwise nobody is left who could answer."""


Answer: TypeAlias = Replied | Failed | NoAnswer
"""How a request ends."""


@dataclass(frozen=True, slots=True)
class Link:
    """What has been exchanged with one other process."""

    session: str
    """The identity of the other process: 32 lower-case hexadecimal digits at most."""

    host: str
    """The name or address of its machine; empty if it is not known."""

    process: int
    """Its process id on that machine; 0 if it is not known."""

    sent_bytes: int
    received_bytes: int

    dropped: int
    """The number of messages for it or from it that this side has dropped."""


Wait: TypeAlias = Callable[[], Coroutine[object, None, None]]
"""What waits for something, if it is called."""

Take: TypeAlias = Callable[[tuple[Any, ...], bytes, int, int, bytes, float | None], Wait | None]
"""What is called with a message, and returns what the next one should wait for, if it may not be lost.

Its arguments are the takers for whom it is, the GID of its publisher, its number among the messages of that publisher from 1, when it was sent (nanoseconds
since 1970), its payload, and when it arrived, in seconds on the loop's clock, if it has waited since then."""


@runtime_checkable
class TakesTogether(Protocol):
    """A `Take` that can take many messages in less time than one after the other."""

    def __call__(
        self, takers: tuple[object, ...], gid: bytes, number: int, source_time: int, payload: bytes, since: float | None
    ) -> Wait | None: ...

    def together(self, takers: tuple[object, ...], gid: bytes, number: int, payloads: list[bytes]) -> bool:
        """Take messages of one publisher, numbered from `number` on. Whether it has: if not, they are to be given one by one."""
        ...


class Handle(Protocol):
    """Something declared to the transport, until it is closed."""

    def close(self) -> None:
        """Withdraw it. Calling it twice is harmless."""
        ...


class NodeHere(Handle, Protocol):
    """A node of this process, shown from its making until it is closed."""

    @property
    def number(self) -> int:
        """What distinguishes it from the other nodes of this process."""
        ...


class EndpointHere(Handle, Protocol):
    """An endpoint of this process, shown from its making until it is closed."""

    @property
    def gid(self) -> bytes:
        """What identifies it on the network, 16 bytes."""
        ...


class PublisherHere(EndpointHere, Protocol):
    """A publisher of this process. It is shown by `show`, and can be used from `open` on; each is harmless the second time."""

    def show(self) -> None:
        """Show it to the others. One that is shown only is opened when somebody subscribes."""
        ...

    def open(self) -> None:
        """Open its sending end."""
        ...

    @property
    def wanted(self) -> bool:
        """Whether a subscription of another process is known. Reading it costs nothing; False until it is open."""
        ...

    @property
    def put(self) -> Callable[[bytes, int, int], None]:
        """Send a message to all matching subscriptions of other processes: its payload, its number from 1, and the time, in nanoseconds since 1970.

        A transient local publisher keeps it for later ones."""
        ...

    @property
    def drained(self) -> Wait | None:
        """A function that waits until everything that was put has been sent. None unless so much is queued, and may not be dropped, that a sender
        that can wait has to."""
        ...

    def assert_liveliness(self) -> None:
        """Show the subscriptions of other processes that it is alive, with MANUAL_BY_TOPIC, if the wire can."""
        ...


class ClientHere(EndpointHere, Protocol):
    """A client of this process."""

    def ask(
        self,
        payload: bytes,
        number: int,
        source_time: int,
        extension: bytes,
        timeout: float | None,
        done: Callable[[Answer], None],
    ) -> Handle:
        """Send a request, numbered from 1; the first answer counts. `done` is called exactly once, unless the handle is closed first.

        `extension` is for servers of this library, which others do not read. After `timeout` seconds, if it has not been closed, it ends with
        `NoAnswer`, and the transport forgets it; None: never.
        """
        ...


class Request(Protocol):
    """A request that has arrived. It must be ended by exactly one of its methods; ending it again does nothing."""

    @property
    def payload(self) -> bytes: ...

    @property
    def gid(self) -> bytes:
        """What identifies the client."""
        ...

    @property
    def number(self) -> int:
        """The number of the request among those of the client."""
        ...

    @property
    def extension(self) -> bytes:
        """What the client adds to it for servers of this library; empty from others."""
        ...

    def reply(self, payload: bytes, source_time: int, extension: bytes) -> None:
        """Answer it."""
        ...

    def fail(self, payload: bytes) -> None:
        """Answer it with an error. A client of ROS 2 logs the payload over Zenoh, and gets nothing over DDS; it goes on waiting."""
        ...

    def drop(self) -> None:
        """Leave it without an answer."""
        ...


class Events(Protocol):
    """What a transport tells its owner."""

    def node(self, node: RemoteNode, there: bool) -> None:
        """A node of another process has appeared, or has vanished."""
        ...

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        """Another process has an endpoint, now or since before this one joined."""
        ...

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        """An endpoint that had appeared has been withdrawn, or its process is lost."""
        ...

    def wanted(self, publisher: PublisherHere) -> None:
        """`PublisherHere.wanted` has changed."""
        ...

    def liveliness(self, gid: bytes) -> None:
        """`RemoteEndpoint.alive` of a publisher has changed."""
        ...

    def link(self, session: str, up: bool) -> None:
        """Another process has been found, or is lost."""
        ...

    def told(self, data: bytes) -> None:
        """Another process of this library has told this one something; see `Participant.tell`."""
        ...

    def lost(self, taker: object, messages: int) -> None:
        """So many messages for a taker are lost, which their numbers do not show."""
        ...

    def unreadable(self, what: str, place: str, error: Exception, **fields: object) -> None:
        """Something that cannot be read has come: `what` describes it, and `place` is the topic or service on which it came."""
        ...


class Participant(Protocol):
    """What this process has in a domain, until its transport is closed."""

    @property
    def complete(self) -> bool:
        """Whether all is known that the processes have which have been found so far, as far as the wire tells."""
        ...

    def node(self, fqn: str) -> NodeHere:
        """Show a node."""
        ...

    def publisher(self, node: NodeHere | None, name: str, type: TypeInfo, qos: QoS) -> PublisherHere:
        """A publisher, not shown and not open. One without a node is never shown: those find it who know its topic."""
        ...

    def subscription(
        self,
        node: NodeHere | None,
        name: str,
        type: TypeInfo,
        qos: QoS,
        take: Take,
        taker: object,
        patience: float = 0.0,
    ) -> EndpointHere:
        """Receive what other processes publish, what is kept for later subscriptions first.

        Volatile subscriptions with the same `take` and the same demands share what arrives: `take` is called once for all their takers. Their
        messages may wait for `patience` seconds, so that the loop is woken for many of them at once. One without a node is not shown.
        """
        ...

    def server(
        self, node: NodeHere, name: str, type: TypeInfo, qos: QoS, take: Callable[[Request], None]
    ) -> EndpointHere:
        """Call `take` with each request of other processes."""
        ...

    def client(self, node: NodeHere, name: str, type: TypeInfo, qos: QoS) -> ClientHere:
        """What asks the servers of other processes."""
        ...

    def tell(self, session: str, data: bytes) -> None:
        """Let `Events.told` be called in one other process of this library, if it is there."""
        ...


class Transport(Protocol):
    """The connection with the other processes of one domain."""

    @property
    def session(self) -> str:
        """The identity of this process on the network: lower-case hexadecimal digits, without leading zeros. Known before `join`."""
        ...

    async def join(self, domain_id: int, events: Events, *, beyond: bool = False) -> Participant:
        """Connect, and tell of all nodes and endpoints of a domain, beginning with those that are there already; with `beyond`, of those of other
        domains, too, if the wire shows them.

        Returns when this process can declare something; other processes may be found later, in any order. Raises `WireUnavailable` if it cannot
        be opened at all. A router or peer that is lost or not there is no error: it is looked for until `close`.
        """
        ...

    async def close(self) -> None:
        """Withdraw everything and disconnect; other processes learn of it at once. No callback is called afterwards. Never raises."""
        ...

    def report(self) -> tuple[Link, ...]:
        """What has been exchanged with each process that is connected now."""
        ...

    def sibling(self) -> Callable[[], Transport]:
        """A function that makes a transport for another process of this machine, which finds this one and whom this one reaches.

        If this transport connects real processes, `pickle` can copy the function to them.
        """
        ...
