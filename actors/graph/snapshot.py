"""Snapshots: the graph at one instant, as a value to print, compare or draw.

`take` copies the present state. A `Snapshot` does not change afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeAlias

import msgspec

from actors.graph.graph import Graph, TopicEntry
from actors.graph.watching import KnownLink, NodeElsewhere
from actors.inbox.load import Load
from actors.names.identity import Identity
from actors.topics.peers import Elsewhere, PublisherPeer, SubscriptionPeer

Places: TypeAlias = "dict[str, tuple[str, int]]"
"""Node of another process -> its host and process."""


class Edge(msgspec.Struct, frozen=True, order=True):
    """One publisher or subscription of a topic: its quality of service as text, and its counters."""

    node: str
    qos: str
    messages: int
    dropped: int = 0
    """Of a subscription of this process: the messages that it has lost. Of a publisher of another process: those that did not get here."""
    waiting: int = 0
    host: str = ""
    """The machine of an endpoint of another process; empty for one of this process, and if it is not known."""
    process: int = 0
    """The process of an endpoint of another process; 0 for one of this process, and if it is not known."""
    bytes: int = 0
    """Of a publisher of another process: what has arrived from it. Of a subscription of another process: what has been sent for it."""


class TopicView(msgspec.Struct, frozen=True):
    """One topic: its types, its endpoints, and how many messages have been published on it."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[Edge, ...]
    subscriptions: tuple[Edge, ...]
    messages: int
    rate: float
    """Messages per second since the topic's first publisher was added."""
    mismatches: tuple[str, ...] = ()
    """Why endpoints of this topic do not match, as text."""


class ServiceView(msgspec.Struct, frozen=True):
    """One service or action: its type and kind, who serves it, who uses it, and how many calls or goals there were and are open."""

    name: str
    type: str
    kind: str
    """"service" or "action"."""
    server: str
    clients: tuple[str, ...]
    calls: int
    open: int
    """The number of unanswered requests or active goals."""


class NodeView(msgspec.Struct, frozen=True):
    """One node: its place in the tree, its state, and how busy it is."""

    name: str
    path: str
    state: str
    incarnation: int
    waiting: int
    """The number of items in the node's inbox."""
    handled: int = 0
    """The number of items handled so far."""
    inbox_age: float = 0.0
    """How long an item has been waiting there, in seconds; see `actors.inbox.load.Load.age`."""
    slowest: str = ""
    """The handler with the longest measured run of one item, and its duration."""
    host: str = ""
    """The machine of a node of another process; empty for a node of this process, and if it is not known."""
    process: int = 0
    """The process of a node of another process; 0 for a node of this process, and if it is not known."""
    session: str = ""
    """The identity on the network of the process of a node of another process, known also where `process` is not; empty for a node of this one."""


class LinkView(msgspec.Struct, frozen=True, order=True):
    """What has been exchanged with one other process since it was found; see `actors.transport.protocol.Link`."""

    host: str
    process: int
    session: str
    sent_bytes: int
    received_bytes: int
    dropped: int
    """The samples for it or from it that this process has dropped."""


class Snapshot(msgspec.Struct, frozen=True):
    """The nodes, topics, services and actions of a system at one instant, each sorted by name.

    It has no public constructor: `System.snapshot` gives one.
    """

    at: float
    nodes: tuple[NodeView, ...]
    topics: tuple[TopicView, ...]
    services: tuple[ServiceView, ...]
    links: tuple[LinkView, ...] = ()
    """The other processes of the domain that can be reached."""

    def to_json(self) -> str:
        """The snapshot as JSON."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1).decode()

    def to_mermaid(self) -> str:
        """A Mermaid flow chart: nodes as boxes, topics as rounded boxes, services and actions as hexagons."""
        ids: dict[str, str] = {}
        lines = ["flowchart LR"]
        for key, label in self._things():
            ids[key] = f"n{len(ids)}"
            left, right = {"node": ("[", "]"), "topic": ("(", ")"), "service": ("{{", "}}")}[key.split(" ")[0]]
            lines.append(f'  {ids[key]}{left}"{label}"{right}')
        lines += [
            f"  {ids[begin]} {'-.->' if dotted else '-->'} {ids[end]}"
            for begin, end, dotted in self._edges()
            if end in ids and begin in ids
        ]
        return "\n".join(lines) + "\n"

    def to_dot(self) -> str:
        """A Graphviz graph with the same content as `to_mermaid`."""
        shapes = {"node": "box", "topic": "ellipse", "service": "hexagon"}
        lines = ["digraph graph_ {", "  rankdir=LR;"]
        known = set[str]()
        for key, label in self._things():
            known.add(key)
            lines.append(f'  "{key}" [label="{label}", shape={shapes[key.split(" ")[0]]}];')
        for begin, end, dotted in self._edges():
            if begin in known and end in known:
                lines.append(f'  "{begin}" -> "{end}"{" [style=dashed]" if dotted else ""};')
        return "\n".join([*lines, "}"]) + "\n"

    def diff(self, other: Snapshot) -> tuple[str, ...]:
        """The changes that lead from this snapshot to `other`, one line each: + for added, - for removed, ~ for changed."""
        lines: list[str] = []
        ours, theirs = self._facts(), other._facts()
        lines += [f"- {fact}" for fact in ours if fact not in theirs]
        lines += [f"+ {fact}" for fact in theirs if fact not in ours]
        lines += [
            f"~ {fact}: {ours[fact]} -> {theirs[fact]}"
            for fact in ours
            if fact in theirs and ours[fact] != theirs[fact]
        ]
        return tuple(sorted(lines, key=lambda line: line[2:]))

    def _things(self) -> Iterable[tuple[str, str]]:
        yield from ((f"node {node.name}", node.name) for node in self.nodes)
        yield from ((f"topic {topic.name}", topic.name) for topic in self.topics)
        yield from ((f"service {service.name}", service.name) for service in self.services)

    def _edges(self) -> Iterable[tuple[str, str, bool]]:
        for topic in self.topics:
            yield from ((f"node {edge.node}", f"topic {topic.name}", False) for edge in topic.publishers)
            yield from ((f"topic {topic.name}", f"node {edge.node}", False) for edge in topic.subscriptions)
        for service in self.services:
            yield from ((f"node {client}", f"service {service.name}", True) for client in service.clients)
            if service.server:
                yield f"service {service.name}", f"node {service.server}", True

    def _facts(self) -> dict[str, str]:
        """The facts that `diff` compares: everything but counters, which always differ."""
        facts = {f"node {node.name}": f"{node.state}, incarnation {node.incarnation}" for node in self.nodes}
        for topic in self.topics:
            facts |= {f"{edge.node} publishes {topic.name}": edge.qos for edge in topic.publishers}
            facts |= {f"{edge.node} subscribes {topic.name}": edge.qos for edge in topic.subscriptions}
        facts |= {
            f"{service.kind} {service.name}": f"served by {service.server or 'nobody'}" for service in self.services
        }
        return facts


class KnownNode(Protocol):
    """What a snapshot requires of a node."""

    @property
    def identity(self) -> Identity: ...

    @property
    def path(self) -> tuple[str, ...]: ...

    @property
    def state(self) -> str: ...

    @property
    def incarnation(self) -> int: ...

    @property
    def load(self) -> Load: ...

    @property
    def process(self) -> int: ...


def take(now: float, nodes: Iterable[KnownNode], graph: Graph) -> Snapshot:
    """Take a snapshot of the nodes and the graph of one system. `now` is in seconds on the system's clock."""
    local = tuple(nodes)
    ours = {(one.identity.fqn, one.process) for one in local}
    known = tuple(graph.elsewhere())
    places = {one.fqn: (one.host, one.process) for one in known}
    # nodes of our own other processes are seen by the transport, too
    others = (one for one in known if not one.process or (one.fqn, one.process) not in ours)
    return Snapshot(
        at=now,
        nodes=tuple(sorted((*map(_node, local), *map(_elsewhere, others)), key=lambda node: node.name)),
        topics=tuple(_topic(entry, now, places) for _, entry in sorted(graph.topics.items())),
        services=tuple(sorted((*_services(graph), *_actions(graph)), key=lambda service: service.name)),
        links=tuple(sorted(map(_link, graph.links()))),
    )


def _node(known: KnownNode) -> NodeView:
    load = known.load
    slowest = f"{load.slowest.handler} {load.slowest.longest:.3g} s" if load.slowest is not None else ""
    return NodeView(
        known.identity.fqn, "/".join(known.path), known.state, known.incarnation, load.waiting, load.handled, round(load.age, 6), slowest,
        process=known.process,
    )  # fmt: skip


def _elsewhere(known: NodeElsewhere) -> NodeView:
    return NodeView(known.fqn, "", "elsewhere", 0, 0, host=known.host, process=known.process, session=known.session)


def _link(known: KnownLink) -> LinkView:
    return LinkView(known.host, known.process, known.session, known.sent_bytes, known.received_bytes, known.dropped)


def _publisher(one: PublisherPeer, places: Places) -> Edge:
    edge = Edge(one.node.fqn, repr(one.qos), one.count)
    if not isinstance(one, Elsewhere):
        return edge
    host, process = places.get(one.node.fqn, ("", 0))
    return msgspec.structs.replace(edge, dropped=one.missed, host=host, process=process, bytes=one.carried_bytes)


def _subscription(one: SubscriptionPeer, places: Places) -> Edge:
    edge = Edge(one.node.fqn, repr(one.qos), one.received, one.dropped, one.waiting)
    if not isinstance(one, Elsewhere):
        return edge
    host, process = places.get(one.node.fqn, ("", 0))
    return msgspec.structs.replace(edge, host=host, process=process, bytes=one.carried_bytes)


def _topic(entry: TopicEntry, now: float, places: Places) -> TopicView:
    seconds = now - entry.opened if entry.opened is not None else 0.0
    return TopicView(
        entry.name,
        entry.type_names,
        tuple(_publisher(one, places) for one in entry.publishers),
        tuple(_subscription(one, places) for one in entry.subscriptions),
        entry.message_count,
        round(entry.message_count / seconds, 6) if seconds > 0.0 else 0.0,
        tuple(f"{publisher} -> {subscriber}: {why}" for (publisher, subscriber, _), why in entry.mismatches.items()),
    )


def _services(graph: Graph) -> Iterable[ServiceView]:
    for name, entry in graph.services.items():
        server = entry.server
        if server is not None:
            yield ServiceView(
                name, server.type.__ros_type__, "service", server.host, tuple(sorted(entry.clients)),
                server.calls, len(server.open()),
            )  # fmt: skip
        elif entry.clients:
            yield ServiceView(name, "", "service", "", tuple(sorted(entry.clients)), 0, 0)


def _actions(graph: Graph) -> Iterable[ServiceView]:
    for name, entry in graph.actions.items():
        server = entry.server
        if server is not None:
            yield ServiceView(
                name, server.type.__ros_type__, "action", server.host, tuple(sorted(entry.clients)), server.goals, server.active,
            )  # fmt: skip
        elif entry.clients:
            yield ServiceView(name, "", "action", "", tuple(sorted(entry.clients)), 0, 0)
