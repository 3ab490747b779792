"""`Domain`: what a process has in a domain of ROS 2 on DDS, and what it knows of the others."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Iterator
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.interfaces import registry
from actors.interfaces.hashes import type_hash
from actors.transport.dds.format.names import DISCOVERY_TOPIC, DdsNames, Role, RosNames, write_names
from actors.transport.dds.format.participants import (
    GUID_SIZE,
    OLD_GID_SIZE,
    ParticipantEntities,
    parse_participant,
    write_participant,
)
from actors.transport.dds.format.qos import EndpointQos, write_qos
from actors.transport.dds.format.user_data import EndpointData, write_endpoint_data, write_pair_id
from actors.transport.dds.known import Known, NodeHere
from actors.transport.dds.services import REMEDY, Client, Server
from actors.transport.dds.topics import Publisher, Receiver, Subscription
from actors.transport.format.errors import WireFormatError
from actors.transport.format.names import NO_TYPE_HASH
from actors.transport.protocol import Events, Link, Request, Take, TypeInfo

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.transport import protocol
    from actors.transport.dds import discovery
    from actors.transport.dds.endpoints import Reader, Sample, Writer
    from actors.transport.dds.participant import Participant

_TOLD: Final = DdsNames("robactor/told", "robactor::msg::dds_::Told_")
"""The topic by which processes of this library tell each other what ROS has no place for."""
_KEPT: Final = 1000
"""Requests, and replies, that wait at most at one end of a service."""
_TO: Final = struct.Struct("<4s32sI")
_HEAD: Final = b"\x00\x01\x00\x00"


class Pair(NamedTuple):
    """The two topics of a service as one of its ends has them."""

    reads: DdsNames
    read_qos: EndpointQos
    writes: DdsNames
    write_qos: EndpointQos


class Domain:
    """The nodes and endpoints of this process in a domain (`protocol.Participant`), and the discovery of the others (`discovery.Events`).

    Invariants: every change of the nodes and their endpoints is published soon on ``ros_discovery_info``. Volatile subscriptions of the same
    topic, type, quality and `take` share a receiver; a transient local one has its own, because what is kept is sent to it alone. Each has an
    endpoint of its own that others see.
    """

    def __init__(self, engine: Participant, session: str, domain_id: int, events: Events) -> None:
        self.engine = engine
        self.events = events
        self.loop = asyncio.get_running_loop()
        self.known = Known(domain_id, events)
        self.services: set[Client | Server] = set()
        """Those of this process."""
        self._session = session
        self._nodes: dict[NodeHere, None] = {}
        self._receivers: dict[object, Receiver] = {}
        self._pairs = count(1)
        self._publishing: asyncio.Handle | None = None
        self._explained: set[str] = set()
        self._gid_size = OLD_GID_SIZE
        self._info: Writer
        self._infos: Reader
        self._tells: Writer
        self._hears: Reader

    def begin(self) -> None:
        """Tell of this process, and listen to others. To be called when the engine is open."""
        kept = EndpointQos(transient_local=True, depth=1)
        self._hears = self.engine.reader(*_TOLD, EndpointQos(depth=1000), self._heard)
        self._tells = self.engine.writer(*_TOLD, EndpointQos(depth=1000))
        self._info = self.engine.writer(*DISCOVERY_TOPIC, kept)
        all_of_them = EndpointQos(transient_local=True, keep_all=True, depth=1000)
        self._infos = self.engine.reader(*DISCOVERY_TOPIC, all_of_them, self._informed)
        self._changed()

    def end(self) -> None:
        """Publish nothing any more. The engine closes what is open."""
        if self._publishing is not None:
            self._publishing.cancel()
        for service in tuple(self.services):
            service.close()

    def explain(self, what: str) -> None:
        """Say once why something cannot work."""
        if what not in self._explained:
            self._explained.add(what)
            self.events.unreadable(what, what, WireFormatError(REMEDY))

    @property
    def complete(self) -> bool:
        return self.known.complete

    def links(self) -> Iterator[Link]:
        """What has been exchanged with each participant."""
        for traffic in self.engine.report():
            peer = self.known.peers.get(traffic.participant.guid)
            if peer is not None:
                host, process = ("", 0) if peer.process is None else (peer.process.host, peer.process.process)
                yield Link(peer.session, host, process, traffic.sent_bytes, traffic.received_bytes, traffic.dropped)

    # -- what this process has ----------------------------------------------------------------------------------------------

    def node(self, fqn: str) -> NodeHere:
        node = NodeHere(fqn, self._changed, self._forget)
        self._nodes[node] = None
        self._changed()
        return node

    def _forget(self, node: NodeHere) -> None:
        if self._nodes.pop(node, self) is None:
            self._changed()

    def _changed(self) -> None:
        if self._publishing is None:
            self._publishing = self.loop.call_soon(self._publish)

    def _publish(self) -> None:
        self._publishing = None
        nodes = tuple(node.entities for node in self._nodes)
        self._info.put(write_participant(ParticipantEntities(self.engine.guid, nodes, self._gid_size)))

    def publisher(self, node: protocol.NodeHere | None, name: str, type: TypeInfo, qos: QoS) -> Publisher:
        names = write_names(RosNames(Role.TOPIC, name, type.name))
        return Publisher(self, _here(node), names, _quality(qos, EndpointData(type.hash)))

    def subscription(
        self,
        node: protocol.NodeHere | None,
        name: str,
        type: TypeInfo,
        qos: QoS,
        take: Take,
        taker: object,
        patience: float = 0.0,
    ) -> Subscription:
        names, quality = write_names(RosNames(Role.TOPIC, name, type.name)), _quality(qos, EndpointData(type.hash))
        group: object = object() if qos.transient_local else (names, quality, take, patience)
        receiver = self._receivers.get(group)
        if receiver is None:
            receiver = self._receivers[group] = Receiver(self, names, quality, take, patience)
        subscription = Subscription(self, _here(node), group, receiver)
        receiver.subscriptions[subscription] = taker
        receiver.takers = tuple(receiver.subscriptions.values())
        return subscription

    def unsubscribe(self, subscription: Subscription, group: object) -> bool:
        """Feed a subscription no more. Returns whether it was fed."""
        receiver = self._receivers.get(group)
        if receiver is None or subscription not in receiver.subscriptions:
            return False
        receiver.forget(subscription)
        if not receiver.subscriptions:
            del self._receivers[group]
            receiver.reader.close()
        return True

    def server(
        self, node: protocol.NodeHere, name: str, type: TypeInfo, qos: QoS, take: Callable[[Request], None]
    ) -> Server:
        pair_id = write_pair_id(self.engine.guid, next(self._pairs))
        request, reply = _both(name, type, qos, server=pair_id)
        return Server(self, _here(node) or self.node("/"), name, Pair(*request, *reply), take)

    def client(self, node: protocol.NodeHere, name: str, type: TypeInfo, qos: QoS) -> Client:
        pair_id = write_pair_id(self.engine.guid, next(self._pairs))
        request, reply = _both(name, type, qos, client=pair_id)
        return Client(self, _here(node) or self.node("/"), name, Pair(*reply, *request))

    # -- between processes of this library ----------------------------------------------------------------------------------

    def tell(self, session: str, data: bytes) -> None:
        self._tells.put(_TO.pack(_HEAD, session.encode(), len(data)) + data + bytes(-len(data) % 4))

    def _heard(self, samples: list[Sample]) -> None:
        for sample in samples:
            if len(sample.payload) >= _TO.size and self.known.ours(sample.writer):
                _, session, length = _TO.unpack_from(sample.payload)
                if session.rstrip(b"\0") == self._session.encode():
                    self.events.told(sample.payload[_TO.size : _TO.size + length])

    # -- what others have ---------------------------------------------------------------------------------------------------

    def _informed(self, samples: list[Sample]) -> None:
        for sample in samples:
            try:
                told = parse_participant(sample.payload)
            except WireFormatError as error:
                self.events.unreadable("the nodes of a participant cannot be read", "", error)
                continue
            if told.gid[:12] != sample.writer[:12]:
                lie = WireFormatError("it names another participant than that which has sent it")
                self.events.unreadable("the nodes of a participant cannot be read", "", lie)
                continue
            if told.swapped:
                self.engine.swap(told.gid, True)
            self.known.told(told)
        self._fit_gids()

    def _fit_gids(self) -> None:
        """Write GIDs as the neighbours do, and as Humble and older do while there are none.

        A process of Humble may end at a message with the newer ones, as it takes a part of a GID for the number of nodes. A newer one sees no
        nodes in a message with the older ones, and then what is written because it is there.
        """
        sizes = {peer.gid_size for peer in self.known.peers.values() if peer.gid_size and peer.process is None}
        size = GUID_SIZE if GUID_SIZE in sizes else OLD_GID_SIZE
        if size != self._gid_size:
            self._gid_size = size
            self._changed()

    def participant_appeared(self, found: discovery.RemoteParticipant) -> None:
        self.known.participant_appeared(found)

    def participant_vanished(self, found: discovery.RemoteParticipant) -> None:
        self.known.participant_vanished(found.guid)
        self.engine.swap(found.guid, False)
        self._fit_gids()

    def endpoint_appeared(self, found: discovery.RemoteEndpoint) -> None:
        self.known.endpoint_appeared(found)
        self._look_at_services(found)

    def endpoint_changed(self, found: discovery.RemoteEndpoint) -> None:
        self.known.endpoint_changed(found)
        self._look_at_services(found)

    def endpoint_vanished(self, found: discovery.RemoteEndpoint) -> None:
        self.known.endpoint_vanished(found)
        self._look_at_services(found)

    def _look_at_services(self, found: discovery.RemoteEndpoint) -> None:
        if found.topic.startswith(("rq/", "rr/")):
            for service in tuple(self.services):
                service.look()


def _here(node: protocol.NodeHere | None) -> NodeHere | None:
    assert node is None or isinstance(node, NodeHere)
    return node


def _quality(qos: QoS, data: EndpointData) -> EndpointQos:
    return write_qos(qos, write_endpoint_data(data))


def _both(
    name: str, type: TypeInfo, qos: QoS, *, server: str = "", client: str = ""
) -> tuple[tuple[DdsNames, EndpointQos], tuple[DdsNames, EndpointQos]]:
    """The topics of requests and of replies, of which more are kept than ROS 2 keeps: those that come at once are all answered."""
    qos = qos.replace(depth=max(qos.limit, _KEPT))
    known: Any = registry.known(type.name)
    hashes = (NO_TYPE_HASH, NO_TYPE_HASH) if known is None else (type_hash(known.Request), type_hash(known.Response))
    request, reply = (
        (write_names(RosNames(role, name, type.name)), _quality(qos, EndpointData(hashed, server, client)))
        for role, hashed in zip((Role.REQUEST, Role.REPLY), hashes, strict=True)
    )
    return request, reply
