"""Publishers and subscriptions of this process on the network."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final, Protocol

from actors.interfaces.cdr import encode, encoder
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.qos import DEFAULT
from actors.qos.policies import Liveliness, QoS
from actors.topics.endpoint import nanoseconds
from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target
from actors.transport.format.tokens import EndpointKind
from actors.transport.local_side import LocalSide, type_info
from actors.transport.protocol import EndpointHere, PublisherHere, RemoteEndpoint, Take, Wait
from actors.transport.remote_topics import RemotePublisher, RemoteSubscription

_MOST_LEFT: Final = 1000
"""Publishers whose numbers are remembered while they are not there."""


class LocalPublisher(PublisherPeer, Protocol):
    """A publisher of this process, which can be listened to without a subscription."""

    on_assert: Callable[[], object] | None

    def attach(self, target: Target) -> None: ...

    def detach(self, target: Target) -> None: ...


class _Sender:
    """Sends the messages of one publisher, each once, however many subscriptions of other processes match.

    Invariants: `send` is among the publisher's targets only while somebody listens, or if the messages are kept for later subscriptions.
    What is published while nobody listens has its numbers, too: a subscription that was out of reach learns from them what it has missed.
    """

    def __init__(self, side: LocalSide, publisher: LocalPublisher, endpoint: PublisherHere) -> None:
        self.publisher = publisher
        self.endpoint = endpoint
        self._wall_ns = side.wall_ns
        self._put = endpoint.put
        self._encode: Callable[[Any], bytes] | None = None
        """Made for the first message: many publishers never send one."""
        self._sent = 0
        self.sent_bytes = 0
        self._unnumbered = publisher.count
        """How many messages of the publisher have no number."""
        self._listening: bool = False
        self._expires = nanoseconds(publisher.qos.lifespan) is not None
        if publisher.qos.liveliness is Liveliness.MANUAL_BY_TOPIC:
            publisher.on_assert = endpoint.assert_liveliness
        if publisher.qos.transient_local:
            publisher.replay(self.send, publisher.qos.limit)
            publisher.attach(self.send)
            self._unnumbered -= self._sent

    def send(self, sent: Any) -> None:
        """The publisher's target. A message that cannot be encoded is lost, and its node says so."""
        message = sent.message if self._expires else sent
        if self._encode is None:
            self._encode = encoder(message.__class__)
        try:
            payload = self._encode(message)
        except UnicodeEncodeError:
            self._unencodable(message)
            return
        number = self.publisher.count - self._unnumbered  # messages that were not sent have numbers, too
        if number <= self._sent:  # one that was kept from before, or was published meanwhile
            number = self._sent + 1
        self._sent = number
        self.sent_bytes += len(payload)
        self._put(payload, number, self._wall_ns())

    def _unencodable(self, message: Any) -> None:
        publisher = self.publisher
        try:
            encode(message)
        except CdrError as error:
            publisher.node.warn("a message cannot be encoded", topic=publisher.entry.name, error=str(error))

    def listen(self, wanted: bool) -> None:
        """Take note whether somebody listens, perhaps without being shown."""
        if wanted != self._listening and not self.publisher.qos.transient_local:
            self._listening = wanted
            (self.publisher.attach if wanted else self.publisher.detach)(self.send)

    def close(self) -> None:
        self.publisher.on_assert = None
        self.publisher.detach(self.send)
        self.endpoint.close()


class _Nobody:
    """The node of a publisher that is not shown."""

    fqn = "a publisher that is not shown"

    def warn(self, event: str, **fields: object) -> None:
        """Do nothing: there is nobody to tell."""


class _Taking:
    """Takes what other processes publish, one by one or together: `protocol.TakesTogether`."""

    def __init__(self, publishers: dict[bytes, RemotePublisher], take: Take) -> None:
        self._publishers = publishers
        self._take = take

    def __call__(self, *message: Any) -> Wait | None:
        return self._take(*message)

    def together(self, takers: tuple[SubscriptionPeer, ...], gid: bytes, number: int, payloads: list[bytes]) -> bool:
        publisher = self._publishers.get(gid)
        return publisher is not None and publisher.arrived_together(number, payloads, takers)


class Topics:
    """The topics of one system on the network.

    Invariants:

    * Each publisher of this process that the wire can represent has one sender, and each such subscription one endpoint.
    * Each publisher and subscription of another process stands in the graph as long as it is known.
    """

    def __init__(self, side: LocalSide) -> None:
        self._side = side
        self._graph = side.runtime.graph
        self._senders: dict[PublisherPeer, _Sender] = {}
        self._by_endpoint: dict[PublisherHere, _Sender] = {}
        self._promised: dict[tuple[str, str], PublisherHere] = {}
        """(node, topic) -> a standard publisher that is shown and not open."""
        self._fed_by: dict[SubscriptionPeer, EndpointHere] = {}
        self._remote: dict[bytes, RemotePublisher | RemoteSubscription] = {}
        self._publishers: dict[bytes, RemotePublisher] = {}
        """Those of other processes, by GID: all of them, and the publishers."""
        self._left: dict[bytes, dict[SubscriptionPeer, int]] = {}
        """By the GID of a publisher that is not there any more, and may only be out of reach: what each subscription had received last."""
        self._taking = _Taking(self._publishers, self._arrived)

    # -- publishers of this process -----------------------------------------------------------------------------------------

    def publisher_joined(self, publisher: LocalPublisher) -> None:
        """Show a publisher. Raises WireFormatError."""
        node, name, qos = publisher.node.fqn, publisher.entry.name, publisher.qos
        endpoint = self._promised.pop((node, name), None)
        if endpoint is None:
            endpoint = self._endpoint(node, name, publisher.type, qos)
        endpoint.open()
        sender = _Sender(self._side, publisher, endpoint)
        self._senders[publisher] = self._by_endpoint[endpoint] = sender
        endpoint.show()
        sender.listen(endpoint.wanted)

    def _endpoint(self, node: str, name: str, type: object, qos: QoS) -> PublisherHere:
        return self._side.participant.publisher(self._side.node(node), name, type_info(type), qos)

    def promise(self, node: str, name: str, type: object, qos: QoS) -> None:
        """Show a standard publisher of a node, which is opened when somebody subscribes. Raises WireFormatError."""
        opened = any((each.node.fqn, each.entry.name) == (node, name) for each in self._senders)
        if not opened and (node, name) not in self._promised:
            endpoint = self._promised[node, name] = self._endpoint(node, name, type, qos)
            endpoint.show()

    def forget(self, node: str) -> None:
        """Withdraw the standard publishers of a node that has ended for good."""
        for key in [key for key in self._promised if key[0] == node]:
            self._promised.pop(key).close()

    def publisher_left(self, publisher: PublisherPeer) -> None:
        sender = self._senders.pop(publisher, None)
        if sender is not None:
            del self._by_endpoint[sender.endpoint]
            sender.close()

    def wanted(self, publisher: PublisherHere) -> None:
        """See `Events.wanted`."""
        sender = self._by_endpoint.get(publisher)
        if sender is not None:
            sender.listen(publisher.wanted)

    def liveliness(self, gid: bytes) -> None:
        """See `Events.liveliness`."""
        publisher = self._remote.get(gid)
        if isinstance(publisher, RemotePublisher):
            publisher.tell_matched()

    def _sent_by(self, publisher: PublisherPeer) -> int:
        """The bytes that a publisher has sent so far; 0 for one that has only just joined."""
        sender = self._senders.get(publisher)
        return 0 if sender is None else sender.sent_bytes

    def _drained(self, publisher: PublisherPeer) -> Wait | None:
        """See `PublisherHere.drained`."""
        sender = self._senders.get(publisher)
        return None if sender is None else sender.endpoint.drained

    def _target_of(self, publisher: PublisherPeer) -> Target:
        return self._senders[publisher].send

    # -- subscriptions of this process --------------------------------------------------------------------------------------

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        """Show a subscription, and receive for it what other processes publish. Raises WireFormatError."""
        side, name, qos = self._side, subscription.entry.name, subscription.qos
        arrived = self._arrived_where_all_is_kept if qos.keep_all and qos.reliable else self._taking
        self._fed_by[subscription] = side.participant.subscription(
            side.node(subscription.node.fqn), name, type_info(subscription.type), qos, arrived,
            subscription, subscription.patience,
        )  # fmt: skip

    def subscription_left(self, subscription: SubscriptionPeer) -> None:
        endpoint = self._fed_by.pop(subscription, None)
        if endpoint is None:
            return
        for received in self._left.values():
            received.pop(subscription, None)
        endpoint.close()

    def _arrived(
        self,
        takers: tuple[SubscriptionPeer, ...],
        gid: bytes,
        number: int,
        source_time: int,
        payload: bytes,
        since: float | None,
    ) -> None:
        """See `protocol.Take`."""
        publisher = self._publishers.get(gid) or self._stranger(takers)
        publisher.arrived(number, source_time, payload, takers, since)

    def _arrived_where_all_is_kept(
        self,
        takers: tuple[SubscriptionPeer, ...],
        gid: bytes,
        number: int,
        source_time: int,
        payload: bytes,
        since: float | None,
    ) -> Wait | None:
        """See `protocol.Take`. The next message waits until all of these have room."""
        self._arrived(takers, gid, number, source_time, payload, since)
        for each in takers:
            if each.full:
                return partial(self._room, takers)
        return None

    async def _room(self, takers: tuple[SubscriptionPeer, ...]) -> None:
        for each in takers:
            while each.full and each in self._fed_by:  # else it has been closed
                await each.room()

    def lost(self, subscription: SubscriptionPeer, messages: int) -> None:
        """See `Events.lost`."""
        subscription.count_lost(messages)

    def _stranger(self, subscriptions: tuple[SubscriptionPeer, ...]) -> RemotePublisher:
        """Stands for a publisher that is not shown, whose quality of service is unknown: it is matched with all that have its type."""
        entry, type = subscriptions[0].entry, subscriptions[0].type
        stranger = RemotePublisher(_Nobody(), entry, ForeignType(*type_info(type)[:2]), DEFAULT, self._side)
        for subscription in subscriptions:
            stranger.join(subscription)
        return stranger

    # -- publishers and subscriptions of other processes --------------------------------------------------------------------

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        """Add an endpoint of another process to the graph."""
        node, gid, entry = endpoint.node, endpoint.gid, self._graph.topic(endpoint.name)
        type, checks = ForeignType(endpoint.type, endpoint.type_hash), node.checks_qos
        if endpoint.kind is EndpointKind.PUBLISHER:
            known = self._left.pop(gid, None)
            publisher = RemotePublisher(
                node, entry, type, endpoint.qos, self._side, known, checks_qos=checks, judged=endpoint.alive
            )
            self._remote[gid] = self._publishers[gid] = publisher
            entry.add_publisher(publisher)
        else:
            subscription = RemoteSubscription(
                node, entry, type, endpoint.qos, self._target_of, self._sent_by, self._drained, checks_qos=checks
            )
            self._remote[gid] = subscription
            entry.add_subscription(subscription)

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        """Undo `appeared`."""
        gid, entry = endpoint.gid, self._graph.topic(endpoint.name)
        peer = self._remote.pop(gid)
        if isinstance(peer, RemotePublisher):
            del self._publishers[gid]
            if received := peer.received:
                self._left[gid] = received
                if len(self._left) > _MOST_LEFT:
                    del self._left[next(iter(self._left))]
            entry.remove_publisher(peer)
        else:
            entry.remove_subscription(peer)
        entry.forget(endpoint.node.fqn)
