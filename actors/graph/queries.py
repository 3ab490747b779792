"""`NodeGraph`: the graph as one node sees it, to ask who is there and to wait for them. Names are expanded and remapped as the node's own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager

import msgspec

from actors.checks import NoPublicConstructor
from actors.errors import CallTimeout
from actors.graph.graph import Graph
from actors.graph.servers import S, ServerEntry
from actors.graph.snapshot import NodeView, Snapshot
from actors.names.identity import Identity
from actors.names.names import expand
from actors.qos.policies import QoS
from actors.time.deadlines import check_timeout
from actors.topics.peers import PublisherPeer, SubscriptionPeer
from actors.waiting import Waiters

LOOK_EVERY = 0.1
"""How often `wait_for_node` looks, seconds: a node without endpoints does not change the graph."""


class Endpoint(msgspec.Struct, frozen=True):
    """A publisher or a subscription."""

    node: str
    """The full name of its node."""
    topic: str
    type: str
    """The name of its message type, such as ``std_msgs/msg/String``."""
    qos: QoS
    """What a publisher offers, or a subscription requests."""
    here: bool
    """Whether it belongs to this process."""


class NodeGraph(metaclass=NoPublicConstructor):
    """The nodes, topics, services and actions that a node can reach, in this process and in others.

    Standard services and topics of a node are listed once somebody has used them: before, they do not exist.

    It has no public constructor: `graph_of` gives one.
    """

    def __init__(self, graph: Graph, identity: Identity, snapshot: Callable[[], Snapshot]) -> None:
        self._graph = graph
        self._identity = identity
        self._snapshot = snapshot

    def __repr__(self) -> str:
        return f"<the graph as {self._identity.fqn} sees it: {self._graph!r}>"

    # -- by name ------------------------------------------------------------------------------------------------------------

    def nodes(self) -> tuple[str, ...]:
        """The full names of the nodes that run, sorted."""
        return tuple(sorted({node.name for node in self._snapshot().nodes if _runs(node)}))

    def topics(self) -> dict[str, tuple[str, ...]]:
        """The topics that have a publisher or a subscription, each with the names of its types; normally one."""
        return {name: entry.type_names for name, entry in sorted(self._graph.topics.items()) if entry.type_names}

    def services(self) -> dict[str, str]:
        """The services that are served, each with the name of its type."""
        return _served(self._graph.services)

    def actions(self) -> dict[str, str]:
        """The actions that are served, each with the name of its type."""
        return _served(self._graph.actions)

    # -- by endpoint --------------------------------------------------------------------------------------------------------

    def publishers(self, topic: str) -> tuple[Endpoint, ...]:
        """The publishers of a topic, in the order in which they came."""
        entry = self._graph.topics.get(self._identity.topic(topic))
        return () if entry is None else tuple(map(_endpoint, entry.publishers))

    def subscriptions(self, topic: str) -> tuple[Endpoint, ...]:
        """The subscriptions of a topic, in the order in which they came."""
        entry = self._graph.topics.get(self._identity.topic(topic))
        return () if entry is None else tuple(map(_endpoint, entry.subscriptions))

    def count_publishers(self, topic: str) -> int:
        return len(self.publishers(topic))

    def count_subscribers(self, topic: str) -> int:
        return len(self.subscriptions(topic))

    def count_services(self, service: str) -> int:
        """How many servers a service has: those of other processes, and one at most here."""
        entry = self._graph.services.get(self._identity.service(service))
        return 0 if entry is None else len(entry.remotes) + (entry.local is not None)

    def count_clients(self, service: str) -> int:
        """How many nodes of this process have called a service."""
        entry = self._graph.services.get(self._identity.service(service))
        return 0 if entry is None else len(entry.clients)

    # -- by node ------------------------------------------------------------------------------------------------------------

    def published_by(self, node: str) -> tuple[Endpoint, ...]:
        """The publishers of a node, by topic. A name without a slash is one of the asking node's namespace."""
        fqn = self._node(node)
        entries = sorted(self._graph.topics.items())
        return tuple(_endpoint(one) for _, entry in entries for one in entry.publishers if one.node.fqn == fqn)

    def subscribed_by(self, node: str) -> tuple[Endpoint, ...]:
        """The subscriptions of a node, by topic."""
        fqn = self._node(node)
        entries = sorted(self._graph.topics.items())
        return tuple(_endpoint(one) for _, entry in entries for one in entry.subscriptions if one.node.fqn == fqn)

    def served_by(self, node: str) -> dict[str, str]:
        """The services and actions that a node serves, each with the name of its type."""
        fqn = self._node(node)
        views = self._snapshot().services
        return {view.name: view.type for view in views if view.server == fqn}

    def called_by(self, node: str) -> tuple[str, ...]:
        """The services and actions that a node of this process has used, sorted."""
        fqn = self._node(node)
        return tuple(view.name for view in self._snapshot().services if fqn in view.clients)

    # -- waiting ------------------------------------------------------------------------------------------------------------

    async def wait_for_publishers(self, topic: str, count: int = 1, *, timeout: float | None = None) -> None:
        """Wait until a topic has `count` publishers. Raises `CallTimeout` after `timeout` seconds; without one there is no limit."""
        name = self._identity.topic(topic)
        await self._until(lambda: self.count_publishers(name) >= count, timeout, f"{count} publisher(s) of {name}")

    async def wait_for_subscribers(self, topic: str, count: int = 1, *, timeout: float | None = None) -> None:
        """Wait until a topic has `count` subscriptions. Raises `CallTimeout` after `timeout` seconds."""
        name = self._identity.topic(topic)
        await self._until(lambda: self.count_subscribers(name) >= count, timeout, f"{count} subscription(s) of {name}")

    async def wait_for_node(self, node: str, *, timeout: float | None = None) -> None:
        """Wait until a node runs, at most a tenth of a second longer. Raises `CallTimeout` after `timeout` seconds."""
        fqn = self._node(node)
        async with _limit(timeout, f"node {fqn}"):
            while fqn not in self.nodes():
                await asyncio.sleep(LOOK_EVERY)

    def changes(self) -> AsyncGenerator[tuple[str, ...], None]:
        """The changes of the graph from now on, each as lines: ``+ /talker publishes /words``, ``- node /talker``.

        What changes while the reader is busy comes as one change. The lines are those of `Snapshot.diff`.
        """
        return self._changes(self._snapshot(), self._graph.version)

    async def _changes(self, last: Snapshot, version: int) -> AsyncGenerator[tuple[str, ...], None]:
        graph, waiters = self._graph, Waiters()
        leave = graph.on_change(waiters.wake_all)
        try:
            while True:
                while graph.version == version:
                    await waiters.wait()
                version, before, last = graph.version, last, self._snapshot()
                if lines := before.diff(last):
                    yield lines
        finally:
            leave()

    async def _until(self, condition: Callable[[], bool], timeout: float | None, wanted: str) -> None:
        waiters = Waiters()
        leave = self._graph.on_change(waiters.wake_all)
        try:
            async with _limit(timeout, wanted):
                while not condition():
                    await waiters.wait()
        finally:
            leave()

    def _node(self, name: str) -> str:
        return expand(name, self._identity.name, self._identity.namespace)


@asynccontextmanager
async def _limit(timeout: float | None, wanted: str) -> AsyncGenerator[None]:
    """Bound a wait, and say what was waited for if it takes longer."""
    if timeout is not None:
        check_timeout(f"the wait for {wanted}", timeout)
    try:
        async with asyncio.timeout(timeout):
            yield
    except TimeoutError:
        raise CallTimeout(f"no {wanted} within {timeout} s") from None


def _runs(node: NodeView) -> bool:
    return node.state in ("running", "starting", "elsewhere")


def _endpoint(one: PublisherPeer | SubscriptionPeer) -> Endpoint:
    return Endpoint(one.node.fqn, one.entry.name, one.type.__ros_type__, one.qos, one.here)


def _served(entries: Mapping[str, ServerEntry[S]]) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, entry in sorted(entries.items()):
        server = entry.server
        if server is not None:
            found[name] = server.type.__ros_type__
    return found
