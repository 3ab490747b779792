"""Publishers and subscriptions of this process on the network."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.interfaces.cdr import encode
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.qos import DEFAULT
from actors.topics.endpoint import nanoseconds
from actors.topics.peers import PublisherPeer, Target
from actors.transport.format.attachments import attachment_writer, parse_attachment
from actors.transport.format.buffers import CPU, BufferKey, write_buffer_key
from actors.transport.format.errors import WireFormatError
from actors.transport.format.gids import gid_of
from actors.transport.format.keys import write_key
from actors.transport.format.sessions import is_ours
from actors.transport.format.tokens import EndpointKind, EndpointToken
from actors.transport.protocol import BULK, NORMAL, Delivery, Handle, Outlet, Sample
from actors.transport.remote_topics import RemotePublisher, RemoteSubscription
from actors.transport.types_here import described_type, is_buffer_aware, is_bulk

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.topics.peers import SubscriptionPeer
    from actors.transport.local_side import Endpoint, LocalSide
    from actors.transport.remote_graph import RemoteNode

__all__ = ["LocalPublisher", "Topics", "delivery_of"]

_MOST_LEFT: Final = 1000
"""Publishers whose numbers are remembered while they are not there."""


class LocalPublisher(PublisherPeer, Protocol):
    """A publisher of this process, which can be listened to without a subscription."""

    def attach(self, target: Target) -> None: ...

    def detach(self, target: Target) -> None: ...


def delivery_of(qos: QoS, type: Any, *, patience: float = 0.0) -> Delivery:
    """What a transport must know of a quality of service, and of a type: images and the like let all other messages pass."""
    return Delivery(
        reliable=qos.reliable,
        keep_all=qos.keep_all and qos.reliable,
        depth=qos.limit,
        history=qos.limit if qos.transient_local else 0,
        priority=BULK if is_bulk(type) else NORMAL,
        patience=patience,
    )


class _Sender:
    """Sends the messages of one publisher, each once, however many subscriptions of other processes match.

    Invariants: `send` is among the publisher's targets only while somebody listens, or if the messages are kept for later subscriptions.
    What is published while nobody listens has its numbers, too: a subscription that was out of reach learns from them what it has missed.
    """

    def __init__(self, side: LocalSide, publisher: LocalPublisher, endpoint: Endpoint, outlet: Outlet) -> None:
        self.publisher = publisher
        self.endpoint = endpoint
        self.outlet = outlet
        self._wall_ns = side.wall_ns
        self._put = outlet.put
        self._attachment = attachment_writer(endpoint.gid)
        self._sent = 0
        self.sent_bytes = 0
        self._unsent = publisher.count
        """What the publisher had published when nobody listened any more."""
        self._listening: bool = False
        self._expires = nanoseconds(publisher.qos.lifespan) is not None
        if publisher.qos.transient_local:
            publisher.replay(self.send, publisher.qos.limit)
            publisher.attach(self.send)

    def send(self, sent: Any) -> None:
        """The publisher's target. A message that cannot be encoded is lost, and its node says so."""
        publisher = self.publisher
        try:
            payload = encode(sent.message if self._expires else sent)
        except CdrError as error:
            publisher.node.warn("a message cannot be encoded", topic=publisher.entry.name, error=str(error))
            return
        self._sent += 1
        self.sent_bytes += len(payload)
        self._put(payload, self._attachment(self._sent, self._wall_ns()))

    def listen(self, wanted: bool) -> None:
        """Take note whether anybody listens, perhaps without a token."""
        if wanted != self._listening and not self.publisher.qos.transient_local:
            self._listening = wanted
            (self.publisher.attach if wanted else self.publisher.detach)(self.send)
            # What is published while nobody listens has its numbers, too: one who was out of reach learns from them what he has missed.
            if wanted:
                self._sent += self.publisher.count - self._unsent
            else:
                self._unsent = self.publisher.count

    def close(self) -> None:
        self.publisher.detach(self.send)
        self.endpoint.close()
        self.outlet.close()


class _Nobody:
    """The node of a publisher without a token."""

    fqn = "a publisher without a token"

    def warn(self, event: str, **fields: object) -> None:
        """Do nothing: there is nobody to tell."""


class _Receiver:
    """One subscription of the transport, and the subscriptions of this process that it feeds."""

    def __init__(self, type: type[Any]) -> None:
        self.type = type
        self.subscriptions: dict[SubscriptionPeer, Endpoint] = {}
        self.takers: tuple[SubscriptionPeer, ...] = ()
        """The same subscriptions, as each message needs them."""
        self.handles: list[Handle] = []


class Topics:
    """The topics of one system on the network.

    Invariants:

    * Each publisher of this process that the format can represent has one sender, and each such subscription is fed by one receiver.
    * Volatile subscriptions of the same key and delivery share a receiver. A transient local one has its own, because what is kept is sent
      to it alone.
    * Each publisher and subscription of another process stands in the graph as long as its token is known.
    """

    def __init__(self, side: LocalSide) -> None:
        self._side = side
        self._graph = side.runtime.graph
        self._senders: dict[PublisherPeer, _Sender] = {}
        self._by_outlet: dict[Outlet, _Sender] = {}
        self._promised: dict[tuple[str, str], Endpoint] = {}
        """(node, topic) -> a standard publisher that is shown and not open."""
        self._receivers: dict[object, _Receiver] = {}
        self._fed_by: dict[SubscriptionPeer, object] = {}
        self._remote: dict[str, RemotePublisher | RemoteSubscription] = {}
        """By token."""
        self._by_gid: dict[bytes, RemotePublisher] = {}
        self._left: dict[bytes, dict[SubscriptionPeer, int]] = {}
        """By the GID of a publisher that is not there any more, and may only be out of reach: what each subscription had received last."""

    # -- publishers of this process -----------------------------------------------------------------------------------------

    def publisher_joined(self, publisher: LocalPublisher) -> None:
        """Show a publisher. Raises WireFormatError."""
        node, name, qos = publisher.node.fqn, publisher.entry.name, publisher.qos
        endpoint = self._promised.pop((node, name), None)
        if endpoint is None:
            endpoint = self._side.endpoint(node, EndpointKind.PUBLISHER, name, described_type(publisher.type), qos)
        outlet = self._side.transport.outlet(write_key(endpoint.token.key), delivery_of(qos, publisher.type))
        sender = _Sender(self._side, publisher, endpoint, outlet)
        self._senders[publisher] = self._by_outlet[outlet] = sender
        endpoint.show()
        sender.listen(outlet.wanted)

    def promise(self, node: str, name: str, type: Any, qos: QoS) -> None:
        """Show a standard publisher of a node, which is opened when somebody subscribes. Raises WireFormatError."""
        opened = any((each.node.fqn, each.entry.name) == (node, name) for each in self._senders)
        if not opened and (node, name) not in self._promised:
            endpoint = self._side.endpoint(node, EndpointKind.PUBLISHER, name, described_type(type), qos)
            self._promised[node, name] = endpoint
            endpoint.show()

    def forget(self, node: str) -> None:
        """Withdraw the standard publishers of a node that has ended for good."""
        for key in [key for key in self._promised if key[0] == node]:
            self._promised.pop(key).close()

    def publisher_left(self, publisher: PublisherPeer) -> None:
        sender = self._senders.pop(publisher, None)
        if sender is not None:
            del self._by_outlet[sender.outlet]
            sender.close()

    def wanted(self, outlet: Outlet) -> None:
        """See `Events.wanted`."""
        sender = self._by_outlet.get(outlet)
        if sender is not None:
            sender.listen(outlet.wanted)

    def _sent_by(self, publisher: PublisherPeer) -> int:
        """The bytes that a publisher has sent so far; 0 for one that has only just joined."""
        sender = self._senders.get(publisher)
        return 0 if sender is None else sender.sent_bytes

    def _target_of(self, publisher: PublisherPeer) -> Target:
        return self._senders[publisher].send

    # -- subscriptions of this process --------------------------------------------------------------------------------------

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        """Show a subscription, and receive for it what other processes publish. Raises WireFormatError."""
        side, qos = self._side, subscription.qos
        backends = CPU if is_buffer_aware(subscription.type) and not qos.transient_local else ()
        type = described_type(subscription.type)
        endpoint = side.endpoint(
            subscription.node.fqn, EndpointKind.SUBSCRIPTION, subscription.entry.name, type, qos, backends
        )
        delivery, key = delivery_of(qos, subscription.type, patience=subscription.patience), endpoint.token.key
        group: object = subscription if qos.transient_local else (key, delivery)
        receiver = self._receivers.get(group)
        if receiver is None:
            receiver = self._receivers[group] = _Receiver(subscription.type)
            keys = [write_key(key)] + ([write_buffer_key(BufferKey(key, None))] if backends else [])
            take = self._taker(receiver)
            receiver.handles += [side.transport.subscribe(one, delivery, take) for one in keys]
        receiver.subscriptions[subscription] = endpoint
        receiver.takers = tuple(receiver.subscriptions)
        self._fed_by[subscription] = group
        endpoint.show()

    def subscription_left(self, subscription: SubscriptionPeer) -> None:
        group = self._fed_by.pop(subscription, None)
        if group is None:
            return
        for received in self._left.values():
            received.pop(subscription, None)
        receiver = self._receivers[group]
        receiver.subscriptions.pop(subscription).close()
        receiver.takers = tuple(receiver.subscriptions)
        if not receiver.subscriptions:
            del self._receivers[group]
            for handle in receiver.handles:
                handle.close()

    def _taker(self, receiver: _Receiver) -> Callable[[Sample], None]:
        def take(sample: Sample) -> None:
            try:
                sent = parse_attachment(sample.attachment)
            except WireFormatError as error:  # dropped, as in ROS 2
                self._side.unreadable.note("an attachment cannot be read", sample.key, error, key=sample.key)
                return
            publisher = self._by_gid.get(sent.gid)
            if publisher is None:
                publisher = self._stranger(receiver.takers)
            publisher.arrived(sent, sample.payload, receiver.type, receiver.takers, sample.since)

        return take

    def _stranger(self, subscriptions: tuple[SubscriptionPeer, ...]) -> RemotePublisher:
        """Stands for a publisher without a token, whose quality of service is unknown: it is matched with all that have its type."""
        entry, type = subscriptions[0].entry, subscriptions[0].type
        stranger = RemotePublisher(_Nobody(), entry, ForeignType(*described_type(type)), DEFAULT, self._side)
        for subscription in subscriptions:
            stranger.join(subscription)
        return stranger

    # -- publishers and subscriptions of other processes --------------------------------------------------------------------

    def appeared(self, node: RemoteNode, token: EndpointToken, text: str) -> None:
        """Add an endpoint of another process to the graph."""
        entry = self._graph.topic(token.name)
        type = ForeignType(token.type, token.type_hash)
        # A transport that gives its sessions no mark has nobody of ROS 2 on it.
        checks = is_ours(node.session) or not is_ours(self._side.transport.session)
        if token.kind is EndpointKind.PUBLISHER:
            gid = gid_of(text)
            publisher = RemotePublisher(
                node, entry, type, token.qos, self._side, self._left.pop(gid, None), checks_qos=checks
            )
            self._remote[text] = self._by_gid[gid] = publisher
            entry.add_publisher(publisher)
        else:
            subscription = RemoteSubscription(
                node, entry, type, token.qos, self._target_of, self._sent_by, checks_qos=checks
            )
            self._remote[text] = subscription
            entry.add_subscription(subscription)

    def vanished(self, token: EndpointToken, text: str) -> None:
        """Undo `appeared`."""
        endpoint = self._remote.pop(text)
        entry = self._graph.topic(token.name)
        if isinstance(endpoint, RemotePublisher):
            gid = gid_of(text)
            del self._by_gid[gid]
            if received := endpoint.received:
                self._left[gid] = received
                if len(self._left) > _MOST_LEFT:
                    del self._left[next(iter(self._left))]
            entry.remove_publisher(endpoint)
        else:
            entry.remove_subscription(endpoint)
        entry.forget(endpoint.node.fqn)
