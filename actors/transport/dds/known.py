"""The nodes and endpoints of other participants, from the discovery data of DDS and from ``ros_discovery_info``. Pure: nothing here waits or sends.

DDS tells of readers and writers, and ``ros_discovery_info`` which node has them; either may come first. What a participant of ROS has is shown when
its node is known. What others have, which know no nodes, is shown at once, as of one node with the name that ROS 2 gives them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces import lookup, registry
from actors.interfaces.errors import InterfaceError
from actors.interfaces.hashes import type_hash
from actors.transport.dds.format.names import Role, RosNames, parse_names
from actors.transport.dds.format.participants import NodeEntities, ParticipantEntities
from actors.transport.dds.format.qos import parse_qos
from actors.transport.dds.format.user_data import (
    EndpointData,
    Process,
    parse_endpoint_data,
    parse_participant_data,
    parse_process,
)
from actors.transport.format.errors import WireFormatError
from actors.transport.format.names import NO_TYPE_HASH, check_chunk, check_namespace
from actors.transport.format.tokens import EndpointKind
from actors.transport.protocol import Events, RemoteEndpoint, RemoteNode

if TYPE_CHECKING:
    from actors.transport.dds import discovery
    from actors.transport.dds.endpoints import Status

FAST_DDS: Final = b"\x01\x0f"
"""How the GUIDs of Fast DDS begin."""

BARE: Final = "/_CREATED_BY_BARE_DDS_APP_"
"""The node of endpoints of programs that are none of ROS."""
_MOST_EARLY: Final = 1000
"""So many participants are remembered that have told of their nodes before they were found."""


def number_of(fqn: str) -> int:
    """The number of a node among those of its process. DDS sends none, so it follows from the name."""
    return int.from_bytes(blake2b(fqn.encode(errors="replace"), digest_size=8).digest(), "big")


@dataclass(eq=False, slots=True)
class Shown:
    """A reader or writer of another participant."""

    of_dds: discovery.RemoteEndpoint
    ros: RosNames
    data: EndpointData
    endpoint: RemoteEndpoint | None = None
    """As it is shown; None while its node is not known, or if it is the other end of a service."""

    @property
    def unanswerable(self) -> bool:
        """Whether it is an end of a service of Fast DDS, whose requests and replies Cyclone DDS cannot pair."""
        return self.of_dds.guid.startswith(FAST_DDS)


@dataclass(eq=False, slots=True)
class Peer:
    """Another participant."""

    guid: bytes
    is_ros: bool
    process: Process | None
    """What a process of this library tells of itself."""
    nodes: dict[str, RemoteNode] = field(default_factory=dict[str, RemoteNode])
    owners: dict[bytes, RemoteNode] = field(default_factory=dict[bytes, RemoteNode])
    """GID -> the node that has it."""
    ends: dict[bytes, Shown] = field(default_factory=dict[bytes, Shown])
    found: set[bytes] = field(default_factory=set[bytes])
    """The GIDs of all its readers and writers that are discovered."""
    gid_size: int = 0
    """That of its ``ros_discovery_info``; 0 if nothing has come."""
    linked: bool = False
    """Whether all that it has told of has been discovered once. Those of Fast DDS take a second for it."""

    @property
    def session(self) -> str:
        return self.process.session if self.process is not None else self.guid.hex().lstrip("0") or "0"


class Known:
    """All that is known of others.

    Invariants: an endpoint is shown exactly while it is discovered and its node is known; `services` holds both ends of all services that are
    discovered, by role and name.
    """

    def __init__(self, domain_id: int, events: Events) -> None:
        self._domain_id = domain_id
        self._events = events
        self.peers: dict[bytes, Peer] = {}
        """By the GUID of the participant."""
        self.services: dict[tuple[Role, str], dict[bytes, Shown]] = {}
        self._early: dict[bytes, ParticipantEntities] = {}
        self._silent: set[bytes] = set()
        """The GUIDs of writers that are not alive, of those that have to show it."""

    def of(self, guid: bytes) -> Peer | None:
        """The participant that a reader or writer belongs to."""
        return self.peers.get(guid[:12] + _PARTICIPANT)

    def ours(self, guid: bytes) -> bool:
        """Whether a reader or writer is one of this library."""
        peer = self.of(guid)
        return peer is not None and peer.process is not None

    # -- what DDS tells -----------------------------------------------------------------------------------------------------

    def participant_appeared(self, found: discovery.RemoteParticipant) -> Peer:
        data = found.user_data
        peer = Peer(found.guid, parse_participant_data(data) is not None, parse_process(data))
        self.peers[found.guid] = peer
        if (early := self._early.pop(found.guid, None)) is not None:
            self._nodes_of(peer, early)
        self._look_at(peer)
        return peer

    def _look_at(self, peer: Peer) -> None:
        """See whether all is discovered that a participant has told of."""
        if not peer.linked and (not peer.is_ros or (peer.gid_size and peer.owners.keys() <= peer.found)):
            peer.linked = True
            self._events.link(peer.session, True)

    @property
    def complete(self) -> bool:
        """Whether all that the participants have told of has been discovered."""
        return all(peer.linked for peer in self.peers.values())

    def participant_vanished(self, guid: bytes) -> None:
        peer = self.peers.pop(guid, None)
        self._early.pop(guid, None)
        if peer is None:
            return
        for end in tuple(peer.ends.values()):
            self._drop(peer, end)
        if peer.linked:
            self._events.link(peer.session, False)
        for node in peer.nodes.values():
            self._events.node(node, False)

    def endpoint_appeared(self, found: discovery.RemoteEndpoint) -> None:
        peer = self.peers.get(found.participant)
        if peer is None or found.guid in peer.found:
            return
        peer.found.add(found.guid)
        self._take_in(peer, found)
        self._look_at(peer)

    def _take_in(self, peer: Peer, found: discovery.RemoteEndpoint) -> None:
        try:
            ros = parse_names(found.topic, found.type)
        except WireFormatError as error:
            self._events.unreadable("a topic of DDS cannot be read", "", error, topic=found.topic)
            return
        if ros.role is Role.OTHER:
            return
        end = peer.ends[found.guid] = Shown(found, ros, parse_endpoint_data(found.qos.user_data))
        if ros.role is not Role.TOPIC:
            self.services.setdefault((ros.role, ros.name), {})[found.guid] = end
        if (owner := self._owner(peer, found.guid)) is not None:
            self._show(end, owner)

    def endpoint_changed(self, found: discovery.RemoteEndpoint) -> None:
        self.endpoint_vanished(found)
        self.endpoint_appeared(found)

    def endpoint_vanished(self, found: discovery.RemoteEndpoint) -> None:
        self._silent.discard(found.guid)
        peer = self.peers.get(found.participant)
        if peer is not None:
            peer.found.discard(found.guid)
            if (end := peer.ends.get(found.guid)) is not None:
                self._drop(peer, end)

    def judged(self, writers: frozenset[bytes], status: Status) -> None:
        """Cyclone DDS has found that some of the writers that a reader is matched with are alive again, or not alive any more.

        It tells how many, and the last of them. If that leaves open which, any are taken: nobody is shown more than their number.
        """
        before = self._silent & writers
        silent = set(before)
        for guid in sorted(writers, key=lambda guid: guid != status.peer):
            if len(silent) != status.not_alive:
                (silent.add if len(silent) < status.not_alive else silent.discard)(guid)
        self._silent = (self._silent - writers) | silent
        for guid in before ^ silent:
            self._events.liveliness(guid)

    def _drop(self, peer: Peer, end: Shown) -> None:
        guid = end.of_dds.guid
        del peer.ends[guid]
        role = end.ros.role, end.ros.name
        if (ends := self.services.get(role)) is not None:
            ends.pop(guid, None)
            if not ends:
                del self.services[role]
        self._hide(end)

    # -- what ros_discovery_info tells --------------------------------------------------------------------------------------

    def told(self, told: ParticipantEntities) -> None:
        """A participant has told of its nodes."""
        peer = self.peers.get(told.gid)
        if peer is not None:
            self._nodes_of(peer, told)
        elif len(self._early) < _MOST_EARLY:
            self._early[told.gid] = told

    def _nodes_of(self, peer: Peer, told: ParticipantEntities) -> None:
        peer.is_ros, peer.gid_size = True, told.gid_size
        nodes = {_fqn(node): node for node in told.nodes}
        owners: dict[bytes, RemoteNode] = {}
        for fqn, node in nodes.items():
            known = peer.nodes.get(fqn)
            if known is None:
                known = peer.nodes[fqn] = RemoteNode(fqn, peer.session, number_of(fqn), self._domain_id)
                self._events.node(known, True)
            owners.update(dict.fromkeys((*node.readers, *node.writers), known))
        peer.owners = owners
        for guid, end in tuple(peer.ends.items()):
            owner = owners.get(guid)
            if end.endpoint is not None and end.endpoint.node is not owner:
                self._hide(end)
            if end.endpoint is None and owner is not None:
                self._show(end, owner)
        for fqn in [fqn for fqn in peer.nodes if fqn not in nodes]:
            self._events.node(peer.nodes.pop(fqn), False)
        self._look_at(peer)

    def _owner(self, peer: Peer, guid: bytes) -> RemoteNode | None:
        owner = peer.owners.get(guid)
        if owner is None and not peer.is_ros:
            owner = peer.owners[guid] = RemoteNode(BARE, peer.session, number_of(BARE), self._domain_id)
        return owner

    # -- what is shown ------------------------------------------------------------------------------------------------------

    def _show(self, end: Shown, node: RemoteNode) -> None:
        found, kind = end.of_dds, _kind(end)
        if kind is None:
            return
        number = int.from_bytes(found.guid[12:], "big")
        qos = parse_qos(found.qos, history_known=not found.guid.startswith(FAST_DDS))
        alive = partial(self._is_alive, found.guid) if found.qos.manual_liveliness else None
        names = end.ros.name, end.ros.type, _hash(end)
        end.endpoint = RemoteEndpoint(node, kind, *names, qos, found.guid, number, alive)
        self._events.appeared(end.endpoint)

    def _is_alive(self, guid: bytes) -> bool:
        return guid not in self._silent

    def _hide(self, end: Shown) -> None:
        endpoint, end.endpoint = end.endpoint, None
        if endpoint is not None:
            self._events.vanished(endpoint)


_PARTICIPANT: Final = bytes.fromhex("000001c1")


def _fqn(node: NodeEntities) -> str:
    return f"{node.namespace.rstrip('/')}/{node.name}"


def _kind(end: Shown) -> EndpointKind | None:
    """A service is shown by the end of its requests."""
    if end.ros.role is Role.TOPIC:
        return EndpointKind.PUBLISHER if end.of_dds.writes else EndpointKind.SUBSCRIPTION
    if end.ros.role is Role.REQUEST:
        return EndpointKind.CLIENT if end.of_dds.writes else EndpointKind.SERVER
    return None


def _hash(end: Shown) -> str:
    """The hash of the type of a topic or service. On DDS a service has those of its messages, and Humble none: then names have to do."""
    told = end.data.type_hash
    if end.ros.role is Role.TOPIC and told != NO_TYPE_HASH:
        return told
    here: Any = _type_here(end.ros.type)
    if here is None:
        return told
    message = here if end.ros.role is Role.TOPIC else getattr(here, "Request", here)
    return type_hash(here) if told in (NO_TYPE_HASH, type_hash(message)) else told


def _type_here(name: str) -> object:
    """The type of this name that this process has, or can load; None if there is none that can be read."""
    known = registry.known(name)
    if known is None:
        with suppress(InterfaceError, ImportError):
            known = lookup.find(name)
    return known


class NodeHere:
    """A node of this process. Raises WireFormatError for a name that the wire cannot represent."""

    def __init__(self, fqn: str, changed: Callable[[], None], forget: Callable[[NodeHere], None]) -> None:
        """`changed` is called when its endpoints have changed, `forget` when it is closed."""
        namespace, _, name = fqn.rpartition("/")
        self.number = number_of(fqn)
        self._namespace = check_namespace(namespace or "/")
        self._name = check_chunk(name, "the name of a node")
        self._changed = changed
        self._forget = forget
        self._readers: Counter[bytes] = Counter()
        self._writers: Counter[bytes] = Counter()

    @property
    def entities(self) -> NodeEntities:
        return NodeEntities(self._namespace, self._name, tuple(self._readers), tuple(self._writers))

    def add(self, *, reader: bytes | None = None, writer: bytes | None = None) -> None:
        """It has one endpoint more."""
        self._readers.update(() if reader is None else (reader,))
        self._writers.update(() if writer is None else (writer,))
        self._changed()

    def remove(self, *, reader: bytes | None = None, writer: bytes | None = None) -> None:
        """It has one endpoint less."""
        for gids, gid in ((self._readers, reader), (self._writers, writer)):
            if gid is not None:
                gids[gid] -= 1
                if not gids[gid]:
                    del gids[gid]
        self._changed()

    def close(self) -> None:
        self._forget(self)
