"""`KeyedParticipant`: the nodes and endpoints of one process in a domain of ROS 2, announced by tokens, with keys, payloads and attachments."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from actors.qos.policies import QoS
from actors.transport import protocol
from actors.transport.format.attachments import ATTACHMENT_SIZE, attached, attacher, attaching, attachment_of, in_order
from actors.transport.format.buffers import CPU, Backend, BufferKey, write_buffer_key
from actors.transport.format.errors import WireFormatError
from actors.transport.format.gids import gid_of
from actors.transport.format.keys import DataKey, write_key
from actors.transport.format.names import is_ours
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, parse_token, write_token
from actors.transport.keyed import protocol as keyed
from actors.transport.keyed.protocol import BULK, NORMAL, Delivery, KeyTransport, Outlet, Query, Replied, Sample
from actors.transport.protocol import Handle, NodeHere, RemoteEndpoint, RemoteNode, Request, Take, TypeInfo, Wait


class Known:
    """The nodes and endpoints of other processes, as their tokens describe them.

    Invariants: a node is known exactly as long as at least one token that contains it; an endpoint exactly as long as its token.
    """

    def __init__(self, session: str) -> None:
        """`session` is that of this process."""
        self._marked = is_ours(session)
        self._nodes: dict[tuple[int, str, int], RemoteNode] = {}
        self._of: dict[str, tuple[RemoteNode, RemoteEndpoint | None]] = {}
        """Token -> the node that it contains, and its endpoint."""
        self._tokens: Counter[RemoteNode] = Counter()
        """How many tokens contain a node."""

    def appeared(self, text: str) -> tuple[RemoteNode, bool, RemoteEndpoint | None]:
        """Take in a token. Returns the node, whether it is new, and the endpoint unless the token is the node's own. Raises WireFormatError."""
        token = parse_token(text)
        of_node = token.node if isinstance(token, EndpointToken) else token
        identity = of_node.domain_id, of_node.session, of_node.node_id
        node = self._nodes.get(identity)
        is_new = node is None
        if node is None:
            # A transport whose sessions have no mark reaches no process of ROS 2.
            checks = is_ours(of_node.session) or not self._marked
            fqn = f"{of_node.namespace.rstrip('/')}/{of_node.name}"
            node = RemoteNode(fqn, of_node.session, of_node.node_id, of_node.domain_id, checks_qos=checks)
            self._nodes[identity] = node
        endpoint: RemoteEndpoint | None = None
        if isinstance(token, EndpointToken):
            endpoint = RemoteEndpoint(
                node, token.kind, token.name, token.type, token.type_hash, token.qos, gid_of(text), token.endpoint_id
            )
        self._of[text] = node, endpoint
        self._tokens[node] += 1
        return node, is_new, endpoint

    def vanished(self, text: str) -> tuple[RemoteEndpoint | None, RemoteNode | None]:
        """Forget a token. Returns its endpoint, and the node if it was its last token; nothing for one that `appeared` has refused."""
        node, endpoint = self._of.pop(text, (None, None))
        if node is None:
            return None, None
        self._tokens[node] -= 1
        if self._tokens[node]:
            return endpoint, None
        del self._tokens[node], self._nodes[node.domain_id, *node.identity]
        return endpoint, node


_TOLD: Final = 5.0
"""The timeout of `KeyedParticipant.tell`, seconds. Its answer is ignored."""


_replied: Final[Callable[[tuple[bytes, bytes]], protocol.Replied]] = partial(tuple.__new__, protocol.Replied)  # pyright: ignore[reportUnknownMemberType]
"""Makes a `Replied` in half the time that its class takes."""


def _delivery_of(qos: QoS, type: TypeInfo, patience: float = 0.0) -> Delivery:
    """The `Delivery` for a quality of service and a type: all other messages overtake images and the like."""
    return Delivery(
        reliable=qos.reliable,
        keep_all=qos.keep_all and qos.reliable,
        depth=qos.limit,
        history=qos.limit if qos.transient_local else 0,
        priority=BULK if type.bulk else NORMAL,
        patience=patience,
    )


class _NodeHere:
    """A node of this process, as it is shown."""

    def __init__(self, token: NodeToken, shown: Handle) -> None:
        self.token = token
        self.number = token.node_id
        self._shown = shown

    def close(self) -> None:
        self._shown.close()


class _Endpoint:
    """An endpoint of this process. Invariant: its token is shown from `show` to `close`."""

    def __init__(self, keys: KeyTransport, token: EndpointToken) -> None:
        self.token = token
        self._text = write_token(token)
        self.gid = gid_of(self._text)
        self._keys = keys
        self._shown: Handle | None = None

    def show(self) -> None:
        """Announce it. To be called after it has been declared to the transport of keys."""
        if self._shown is None:
            self._shown = self._keys.announce(self._text)

    def close(self) -> None:
        """Withdraw it."""
        if self._shown is not None:
            self._shown.close()


class _Publisher:
    """A publisher of this process: its endpoint, unless it has no node, and its sending end from `open` on."""

    def __init__(
        self, participant: KeyedParticipant, key: DataKey, delivery: Delivery, endpoint: _Endpoint | None
    ) -> None:
        self.gid = gid_of(f"{key.name}/{participant.session}") if endpoint is None else endpoint.gid
        self._participant = participant
        self._key = key
        self._delivery = delivery
        self._endpoint = endpoint
        self._outlet: Outlet | None = None
        self.put: Callable[[bytes, int, int], None] = _unopened

    @property
    def wanted(self) -> bool:
        return self._outlet is not None and self._outlet.wanted

    @property
    def drained(self) -> Wait | None:
        return None if self._outlet is None else self._outlet.drained

    def show(self) -> None:
        if self._endpoint is not None:
            self._endpoint.show()

    def open(self) -> None:
        if self._outlet is None:
            self._outlet = self._participant.opened(self, write_key(self._key), self._delivery)
            self.put = attaching(self.gid, self._outlet.put)

    def assert_liveliness(self) -> None:
        """Do nothing: ``rmw_zenoh`` has nothing to send for it."""

    def close(self) -> None:
        if self._endpoint is not None:
            self._endpoint.close()
        outlet, self._outlet = self._outlet, None
        if outlet is not None:
            self._participant.closed(outlet)


def _unopened(payload: bytes, number: int, source_time: int) -> None:
    """A publisher that is not open sends nothing."""


class _Receiver:
    """One subscription to keys, and the takers that it feeds."""

    def __init__(self) -> None:
        self.endpoints: dict[_Subscription, object] = {}
        self.takers: tuple[object, ...] = ()
        """Those of the endpoints, as each message needs them."""
        self.handles: list[Handle] = []


class _ArrivingAlone:
    """Passes on the samples of a receiver, one by one."""

    def __init__(self, receiver: _Receiver, take: Take, events: protocol.Events) -> None:
        self._receiver = receiver
        self._take = take
        self._events = events

    def __call__(self, sample: Sample) -> Wait | None:
        key, payload, attachment, since = sample
        try:
            number, source_time, gid = attached(attachment)
        except WireFormatError as error:  # dropped, as in ROS 2
            self._events.unreadable("an attachment cannot be read", key, error, key=key)
            return None
        return self._take(self._receiver.takers, gid, number, source_time, payload, since)


class _Arriving(_ArrivingAlone):
    """As `_ArrivingAlone`, and many samples at once: `keyed.TakesTogether`."""

    _take: Any

    def together(self, payloads: list[bytes], attachments: list[bytes]) -> bool:
        try:
            ordered = in_order(attachments)
        except WireFormatError:
            return False
        return ordered is not None and self._take.together(self._receiver.takers, ordered[1], ordered[0], payloads)


class _Subscription:
    """A subscription of this process: its endpoint, unless it has no node, and its receiver."""

    def __init__(self, participant: KeyedParticipant, group: object, endpoint: _Endpoint | None) -> None:
        self.gid = b"" if endpoint is None else endpoint.gid
        self._participant = participant
        self._group = group
        self._endpoint = endpoint

    def close(self) -> None:
        self._participant.unsubscribe(self, self._group)
        if self._endpoint is not None:
            self._endpoint.close()


class _Server:
    """A server of this process."""

    def __init__(self, endpoint: _Endpoint, serving: Handle) -> None:
        self.gid = endpoint.gid
        self._endpoint = endpoint
        self._serving = serving

    def close(self) -> None:
        self._endpoint.close()
        self._serving.close()


class _Client:
    """A client of this process."""

    def __init__(self, keys: KeyTransport, endpoint: _Endpoint) -> None:
        self.gid = endpoint.gid
        self._endpoint = endpoint
        self._keys = keys
        self._key = write_key(endpoint.token.key)
        self._attach = attacher(endpoint.gid)
        self._prepared = keys.prepare(self._key)
        endpoint.show()

    def ask(
        self,
        payload: bytes,
        number: int,
        source_time: int,
        extension: bytes,
        timeout: float | None,
        done: Callable[[protocol.Answer], None],
    ) -> Handle:
        def answered(answer: keyed.Answer) -> None:
            if isinstance(answer, Replied):
                payload, attachment = answer
                done(_replied((payload, attachment[ATTACHMENT_SIZE:])))
            else:
                done(answer)

        attachment = self._attach(number, source_time) + extension
        return self._keys.ask(self._key, payload, attachment, timeout, answered)

    def close(self) -> None:
        self._endpoint.close()
        self._prepared.close()


class _Request:
    """A request of another process."""

    def __init__(self, query: Query, number: int, gid: bytes, extension: bytes) -> None:
        self._query = query
        self.payload = query.payload
        self.gid = gid
        self.number = number
        self.extension = extension
        self.fail = query.fail
        self.drop = query.drop

    def reply(self, payload: bytes, source_time: int, extension: bytes) -> None:
        self._query.reply(payload, attachment_of(self.number, source_time, self.gid, extension))


class KeyedParticipant:
    """The nodes and endpoints of one process in a domain (`protocol.Participant`), and what it knows of the others (`keyed.Events`).

    Invariants: nodes and endpoints are numbered together, from 0; each new one has a new number. Volatile subscriptions of the same key, delivery and
    `take` share a receiver; a transient local one has its own, because what is kept is sent to it alone.
    """

    def __init__(self, keys: KeyTransport, domain_id: int, events: protocol.Events) -> None:
        self.session = keys.session
        self._keys = keys
        self._domain_id = domain_id
        self._events = events
        self._known = Known(keys.session)
        self._numbers = 0
        self._publishers: dict[Outlet, _Publisher] = {}
        self._receivers: dict[object, _Receiver] = {}

    def begin(self) -> None:
        """Take the notifications of other processes. To be called when the transport is open."""
        self._keys.serve(self._waits(self.session), self._told)

    @property
    def complete(self) -> bool:
        return True  # the tokens of a process come together

    # -- what this process has ----------------------------------------------------------------------------------------------

    def node(self, fqn: str) -> _NodeHere:
        namespace, _, name = fqn.rpartition("/")
        token = NodeToken(self._domain_id, self.session, self._numbers, name, namespace or "/")
        text = write_token(token)
        self._numbers += 1
        return _NodeHere(token, self._keys.announce(text))

    def _endpoint(
        self,
        node: NodeHere,
        kind: EndpointKind,
        name: str,
        type: TypeInfo,
        qos: QoS,
        backends: tuple[Backend, ...] = (),
    ) -> _Endpoint:
        """A new endpoint, not shown yet."""
        assert isinstance(node, _NodeHere)
        token = EndpointToken(node.token, self._numbers, kind, name, type.name, type.hash, qos, backends)
        endpoint = _Endpoint(self._keys, token)
        self._numbers += 1
        return endpoint

    def publisher(self, node: NodeHere | None, name: str, type: TypeInfo, qos: QoS) -> _Publisher:
        endpoint = None if node is None else self._endpoint(node, EndpointKind.PUBLISHER, name, type, qos)
        delivery = Delivery(depth=2, priority=7) if node is None else _delivery_of(qos, type)
        return _Publisher(self, DataKey(self._domain_id, name, type.name, type.hash), delivery, endpoint)

    def opened(self, publisher: _Publisher, key: str, delivery: Delivery) -> Outlet:
        """The sending end of a publisher."""
        outlet = self._keys.outlet(key, delivery)
        self._publishers[outlet] = publisher
        return outlet

    def closed(self, outlet: Outlet) -> None:
        """Close the sending end of a publisher."""
        del self._publishers[outlet]
        outlet.close()

    def subscription(
        self,
        node: NodeHere | None,
        name: str,
        type: TypeInfo,
        qos: QoS,
        take: Take,
        taker: object,
        patience: float = 0.0,
    ) -> _Subscription:
        backends = CPU if type.buffers and not qos.transient_local else ()
        endpoint = None if node is None else self._endpoint(node, EndpointKind.SUBSCRIPTION, name, type, qos, backends)
        key, delivery = DataKey(self._domain_id, name, type.name, type.hash), _delivery_of(qos, type, patience)
        group: object = object() if qos.transient_local else (key, delivery, take)
        subscription = _Subscription(self, group, endpoint)
        receiver = self._receivers.get(group)
        if receiver is None:
            receiver = self._receivers[group] = _Receiver()
            keys = [write_key(key)] + ([write_buffer_key(BufferKey(key, None))] if backends else [])
            arriving = _Arriving if isinstance(take, protocol.TakesTogether) else _ArrivingAlone
            arrived = arriving(receiver, take, self._events)
            receiver.handles += [self._keys.subscribe(one, delivery, arrived) for one in keys]
        receiver.endpoints[subscription] = taker
        receiver.takers = tuple(receiver.endpoints.values())
        if endpoint is not None:
            endpoint.show()
        return subscription

    def unsubscribe(self, subscription: _Subscription, group: object) -> None:
        """Feed a subscription no more."""
        receiver = self._receivers.get(group)
        if receiver is None or receiver.endpoints.pop(subscription, None) is None:
            return
        receiver.takers = tuple(receiver.endpoints.values())
        if not receiver.endpoints:
            del self._receivers[group]
            for handle in receiver.handles:
                handle.close()

    def server(self, node: NodeHere, name: str, type: TypeInfo, qos: QoS, take: Callable[[Request], None]) -> _Server:
        endpoint = self._endpoint(node, EndpointKind.SERVER, name, type, qos)

        def arrived(query: Query) -> None:
            attachment = query.attachment
            try:
                number, _, gid = attached(attachment)
            except WireFormatError as error:
                query.drop()  # as in ROS 2
                self._events.unreadable("a request has no attachment that can be read", name, error, service=name)
            else:
                take(_Request(query, number, gid, attachment[ATTACHMENT_SIZE:]))

        serving = self._keys.serve(write_key(endpoint.token.key), arrived)
        endpoint.show()
        return _Server(endpoint, serving)

    def client(self, node: NodeHere, name: str, type: TypeInfo, qos: QoS) -> _Client:
        return _Client(self._keys, self._endpoint(node, EndpointKind.CLIENT, name, type, qos))

    # -- between processes of this library ----------------------------------------------------------------------------------

    def tell(self, session: str, data: bytes) -> None:
        self._keys.ask(self._waits(session), data, b"", _TOLD, _ignore)

    def _told(self, query: Query) -> None:
        query.drop()
        self._events.told(query.payload)

    def _waits(self, session: str) -> str:
        return f"@robactor/{self._domain_id}/{session}/waits"

    # -- what the transport of keys reports ---------------------------------------------------------------------------------

    def appeared(self, token: str) -> None:
        """See `keyed.Events.appeared`."""
        try:
            node, is_new, endpoint = self._known.appeared(token)
        except WireFormatError as error:
            self._events.unreadable("a token cannot be read", "", error, token=token)
            return
        if is_new:
            self._events.node(node, True)
        if endpoint is not None:
            self._events.appeared(endpoint)

    def vanished(self, token: str) -> None:
        """See `keyed.Events.vanished`."""
        endpoint, node = self._known.vanished(token)
        if endpoint is not None:
            self._events.vanished(endpoint)
        if node is not None:
            self._events.node(node, False)

    def wanted(self, outlet: Outlet) -> None:
        """See `keyed.Events.wanted`."""
        publisher = self._publishers.get(outlet)
        if publisher is not None:
            self._events.wanted(publisher)

    def link(self, session: str, up: bool) -> None:
        """See `keyed.Events.link`."""
        self._events.link(session, up)


def _ignore(answer: object) -> None:
    """Do nothing: the question has arrived."""
