"""Topics by way of bytes: a publisher and a subscription meet each other's stand-ins, never each other.

A topic has two sides, each with an entry of its own. At the near side are the publishers, and for each subscription a `RemoteSubscription`;
at the far side are the subscriptions, and for each publisher a `RemotePublisher`. An endpoint that comes is announced at the other side at
once: its node's name, its type, its quality of service. Messages cross as CDR, once for each publisher however many subscriptions match.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, NamedTuple

from actors.graph.graph import Graph, TopicEntry
from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.message import Message
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target


class Packet(NamedTuple):
    """One message on its way."""

    number: int
    """The how-manieth message of its publisher it is."""
    data: bytes
    expires: float | None
    """Nanoseconds on the loop's clock, which both sides share here."""


def packed(number: int, sent: Message | ExpiringMessage[Any]) -> Packet:
    """A message as it goes onto the wire."""
    if isinstance(sent, ExpiringMessage):
        return Packet(number, encode(sent.message), sent.expires)
    return Packet(number, encode(sent), None)


def bare(arrived: Message | ExpiringMessage[Any]) -> Any:
    """The message itself."""
    return arrived.message if isinstance(arrived, ExpiringMessage) else arrived


class RemoteNode:
    """A node of another process: its warnings are logged there."""

    def __init__(self, fqn: str) -> None:
        self.fqn = fqn

    def warn(self, event: str, **fields: object) -> None:
        pass


class LoopbackTopic(TopicEntry):
    """The near side of a topic. Whoever comes is announced at the other side, and whoever leaves is gone from both."""

    __slots__ = ("far", "there")

    def __init__(self, graph: Graph, name: str, far: Graph) -> None:
        super().__init__(graph, name)
        self.far = far.topic(name)
        self.there: dict[Any, RemotePublisher | RemoteSubscription] = {}
        """Each endpoint's stand-in at the other side."""

    def add_publisher(self, publisher: PublisherPeer) -> None:
        super().add_publisher(publisher)
        self.there[publisher] = stand_in = RemotePublisher(publisher, self.far)
        self.far.add_publisher(stand_in)

    def remove_publisher(self, publisher: PublisherPeer) -> None:
        super().remove_publisher(publisher)
        stand_in = self.there.pop(publisher, None)
        if isinstance(stand_in, RemotePublisher):
            self.far.remove_publisher(stand_in)

    def add_subscription(self, subscription: SubscriptionPeer) -> None:
        self.there[subscription] = stand_in = RemoteSubscription(subscription, self)
        super().add_subscription(stand_in)
        self.far.add_subscription(subscription)

    def remove_subscription(self, subscription: SubscriptionPeer) -> None:
        self.far.remove_subscription(subscription)
        stand_in = self.there.pop(subscription, None)
        if isinstance(stand_in, RemoteSubscription):
            super().remove_subscription(stand_in)

    def forget(self, node: str) -> None:
        super().forget(node)
        self.far.forget(node)


class RemoteSubscription:
    """A subscription as its publishers' process knows it. Counts, room and events are asked for at the other side."""

    here = False
    checks_qos = True

    def __init__(self, announced: SubscriptionPeer, entry: LoopbackTopic) -> None:
        self.node = RemoteNode(announced.node.fqn)
        self.type = announced.type
        self.qos = announced.qos
        self.entry = entry
        self._announced = announced
        self._publishers: dict[PublisherPeer, None] = {}

    def __repr__(self) -> str:
        return repr(self._announced)

    @property
    def received(self) -> int:
        return self._announced.received

    @property
    def dropped(self) -> int:
        return self._announced.dropped

    @property
    def waiting(self) -> int:
        return self._announced.waiting

    @property
    def full(self) -> bool:
        return self._announced.full

    async def room(self) -> None:
        await self._announced.room()

    @property
    def patient(self) -> bool:
        return False

    def target(self, publisher: PublisherPeer) -> Target:
        """The same for every subscription: the message crosses once."""
        stand_in = self.entry.there[publisher]
        assert isinstance(stand_in, RemotePublisher)
        return stand_in.send

    def notify(self) -> None:
        self._announced.notify()

    def count_lost(self, messages: int) -> None:
        self._announced.count_lost(messages)

    def count_incompatible_qos(self, policy: str) -> None:
        """Its own process finds the publisher, too, and counts it."""

    def count_incompatible_type(self) -> None:
        """As above."""

    def join(self, publisher: PublisherPeer) -> None:
        self._publishers[publisher] = None

    def part(self, publisher: PublisherPeer) -> None:
        self._publishers.pop(publisher, None)

    def leave(self) -> tuple[PublisherPeer, ...]:
        publishers, self._publishers = tuple(self._publishers), {}
        return publishers

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Its own process asks for what is latched."""


class RemotePublisher:
    """A publisher as its subscriptions' process knows it: what arrives is decoded once, and handed to all of them.

    Messages are kept by their numbers as long as the publisher latches them, so that one that comes twice (on its way, and because somebody asks
    for what is latched) is one object.
    """

    here = False
    checks_qos = True

    def __init__(self, announced: PublisherPeer, entry: TopicEntry) -> None:
        self.node = RemoteNode(announced.node.fqn)
        self.type = announced.type
        self.qos = announced.qos
        self.entry = entry
        self.count = 0
        self.packets = 0
        """How many messages have crossed."""
        self._announced = announced
        self._subscriptions: dict[SubscriptionPeer, None] = {}
        self._taps: list[Callable[[Any], None]] = []
        self._kept: OrderedDict[int, Message] = OrderedDict()

    def __repr__(self) -> str:
        return repr(self._announced)

    # -- the near side ------------------------------------------------------------------------------------------------------

    def send(self, sent: Message | ExpiringMessage[Any]) -> None:
        """The publisher's target: put the message onto the wire. What no wire can carry is lost, and the publisher's node says so."""
        try:
            packet = packed(self._announced.count, sent)
        except CdrError as error:
            self._announced.node.warn("a message cannot be encoded", topic=self.entry.name, error=str(error))
            return
        self._arrive(packet)

    def _query(self) -> list[Packet]:
        """What is latched there, oldest first."""
        answer: list[Message | ExpiringMessage[Any]] = []
        self._announced.replay(answer.append, self.qos.limit)
        first = self._announced.count - len(answer) + 1
        return [packed(first + index, sent) for index, sent in enumerate(answer)]

    # -- the far side -------------------------------------------------------------------------------------------------------

    def _arrive(self, packet: Packet) -> None:
        self.packets += 1
        self.count = packet.number
        message = self._unpacked(packet)
        for subscription in tuple(self._subscriptions):
            self.entry.target(self, subscription)(message)
        for tap in self._taps:
            tap(bare(message))

    def _unpacked(self, packet: Packet) -> Message | ExpiringMessage[Any]:
        """The message as this publisher's subscriptions take it."""
        message = self._kept.get(packet.number)
        if message is None:
            message = decode(self.type, packet.data)
            if self.qos.transient_local:
                self._kept[packet.number] = message
                if len(self._kept) > self.qos.limit:
                    self._kept.popitem(last=False)
        if packet.expires is None:
            return message
        return ExpiringMessage(message, packet.expires, asyncio.get_running_loop().time)

    @property
    def latched(self) -> list[Any]:
        return [bare(self._unpacked(packet)) for packet in self._query()]

    def replay(self, target: Target, depth: int) -> None:
        for packet in self._query()[-depth:]:
            target(self._unpacked(packet))

    def alive(self, lease_ns: int | None) -> bool:
        return self._announced.alive(lease_ns)

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        return self._announced.due_alive(lease_ns, now)

    def notify(self) -> None:
        """Its own process has told it already."""

    def count_incompatible_qos(self, policy: str) -> None:
        """Its own process finds the subscription, too, and counts it."""

    def count_incompatible_type(self) -> None:
        """As above."""

    def join(self, subscription: SubscriptionPeer) -> None:
        self._subscriptions[subscription] = None

    def part(self, subscription: SubscriptionPeer) -> None:
        self._subscriptions.pop(subscription, None)

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        subscriptions, self._subscriptions = tuple(self._subscriptions), {}
        return subscriptions

    def add_tap(self, tap: Callable[[Any], None]) -> None:
        self._taps.append(tap)
