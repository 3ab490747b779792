"""`Bridge`: connects the graph of one system with the processes that its transport reaches.

It announces the nodes and endpoints of this process, and adds an object for each endpoint of another process to the graph. Everything else,
such as matching, QoS events and calls, is then done as within one process. All nodes and endpoints are announced: use another domain for
those that other processes must not see.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Any, Final, cast

from actors.checks import NoPublicConstructor, create
from actors.graph.servers import S, ServerEntry
from actors.graph.watching import NodeElsewhere
from actors.inbox.boundary import outside
from actors.runtime.incarnation import Incarnation
from actors.runtime.runtime import NodeRecord, Runtime
from actors.topics.peers import PublisherPeer, SubscriptionPeer
from actors.transport.cycles import Cycles
from actors.transport.domain_id import domain_from_environment
from actors.transport.figures import StatsPublisher
from actors.transport.format.errors import WireFormatError
from actors.transport.format.tokens import EndpointKind
from actors.transport.local_actions import Actions
from actors.transport.local_clients import Clients
from actors.transport.local_services import Services
from actors.transport.local_side import LocalSide
from actors.transport.local_topics import LocalPublisher, Topics
from actors.transport.protocol import PublisherHere, RemoteEndpoint, RemoteNode, Transport, WireUnavailable
from actors.transport.same_names import SameNames
from actors.transport.standard_names import standard_publishers, standard_services

TOPICS: Final = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)


def connect(runtime: Runtime, transport: Transport, domain_id: int | None = None) -> None:
    """Connect a system with the other processes of a domain: that of ROS_DOMAIN_ID, or 0, unless one is given.

    To be called before the tree of the system starts. The transport is opened beside the start, and closed after the stop. One that cannot
    be opened is logged, and the system then runs alone. Raises ValueError for an invalid ROS_DOMAIN_ID.
    """
    bridge = create(Bridge, runtime, transport, domain_from_environment(os.environ) if domain_id is None else domain_id)
    runtime.distinguish(transport.session)
    runtime.observers.opening.append(bridge.open)
    runtime.observers.closing.append(bridge.close)


class Bridge(metaclass=NoPublicConstructor):
    """The connection of one system with other processes, for as long as its transport is open.

    It has no public constructor: `connect` makes one.

    Invariants:

    * While it is `_open`, it watches the graph; every endpoint of this process is shown, and every known endpoint of another one stands in
      the graph. Before and after that, none is.
    * What the transport reports before it is open is kept in `_early`, in order.
    """

    def __init__(self, runtime: Runtime, transport: Transport, domain_id: int) -> None:
        self._runtime = runtime
        self._graph = runtime.graph
        self._transport = transport
        self._domain_id = domain_id
        self._side = side = LocalSide(transport, runtime)
        self._nodes: dict[RemoteNode, None] = {}
        """Those of other processes."""
        self._same_names = SameNames(runtime, self._nodes)
        self._endpoints: dict[bytes, RemoteEndpoint] = {}
        """Those of other processes, by GID."""
        self._topics = Topics(side)
        self._cycles = Cycles(side)
        self._clients = Clients(side, self._cycles)
        self._services = Services(side, self._clients)
        self._actions = Actions(side, self._topics, self._services, self._clients)
        self._stats = StatsPublisher(side)
        self._begun = False
        """Whether the transport has to be closed."""
        self._open = False
        self._early: list[Callable[[], None]] = []

    async def open(self) -> None:
        """Open the transport, and show what is there. Logs it if that is not possible."""
        self._begun = True
        try:
            self._side.participant = await self._transport.join(self._domain_id, self)
        except WireUnavailable as error:
            self._begun = False
            self._runtime.log.error("no connection with other processes", because=str(error))
            return
        self._open = True
        graph, observers = self._graph, self._runtime.observers
        for topic in list(graph.topics.values()):
            for publisher in topic.publishers:
                self.publisher_joined(publisher)
            for subscription in topic.subscriptions:
                self.subscription_joined(subscription)
        for service in list(graph.services.values()):
            self.server_changed(service)
        for action in list(graph.actions.values()):
            self.server_changed(action)
        for record in self._runtime.directory.records.values():
            if record.running is not None:
                self._ready(record.running)
        graph.watchers.append(self)
        graph.elsewhere, graph.links = self._nodes_elsewhere, self._transport.report
        graph.complete = lambda: self._side.participant.complete
        observers.ready.append(self._ready)
        observers.dismissed.append(self._dismissed)
        early, self._early = self._early, []
        for tell in early:
            tell()
        self._stats.open()

    async def close(self) -> None:
        """Withdraw everything, and close the transport. The other processes learn of it at once."""
        if self._open:
            self._graph.watchers.remove(self)
        self._open = False
        self._stats.close()
        self._same_names.close()
        if self._begun:
            await self._transport.close()
        for endpoint in list(self._endpoints.values()):
            self._gone(endpoint)
        self._nodes.clear()
        self._graph.elsewhere = self._graph.links = tuple
        self._graph.complete = lambda: True
        if self._side.unreadable.count:
            self._runtime.log.warning("data of other processes could not be read", count=self._side.unreadable.count)

    # -- this process -------------------------------------------------------------------------------------------------------
    # The graph is changed by code of nodes. What a transport schedules then, and the clocks that it reads, are its own: `outside`.

    def publisher_joined(self, publisher: PublisherPeer) -> None:
        if publisher.here:
            with outside(), self._representable(publisher.node.fqn, publisher.entry.name):
                self._topics.publisher_joined(cast("LocalPublisher", publisher))

    def publisher_left(self, publisher: PublisherPeer) -> None:
        with outside():
            self._topics.publisher_left(publisher)

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        if subscription.here:
            with outside(), self._representable(subscription.node.fqn, subscription.entry.name):
                self._topics.subscription_joined(subscription)

    def subscription_left(self, subscription: SubscriptionPeer) -> None:
        with outside():
            self._topics.subscription_left(subscription)

    def server_changed(self, entry: ServerEntry[S]) -> None:
        with outside(), self._representable("" if entry.local is None else entry.local.host, entry.name):
            part = self._actions if entry.kind == "action" else self._services
            part.server_changed(entry)

    def server_sought(self, entry: ServerEntry[S]) -> None:
        """Do nothing: the servers of other processes are announced to all."""

    def _ready(self, life: Incarnation) -> None:
        self._same_names.started(life.fqn)
        self._clients.started(life.fqn)
        with self._representable(life.fqn, life.fqn):
            self._side.node(life.fqn)
            for service in standard_services(life):
                self._services.promise(life.fqn, *service)
            for topic in standard_publishers(life):
                self._topics.promise(life.fqn, *topic)

    def _dismissed(self, record: NodeRecord) -> None:
        for part in (self._actions, self._topics, self._services, self._clients):
            part.forget(record.identity.fqn)

    @contextmanager
    def _representable(self, node: str, name: str) -> Generator[None]:
        """Log it if the format cannot represent what the block shows; it then stays in this process."""
        try:
            yield
        except WireFormatError as error:
            self._runtime.log.warning("not visible to other processes", node_name=node, what=name, because=str(error))

    # -- other processes ----------------------------------------------------------------------------------------------------

    def node(self, node: RemoteNode, there: bool) -> None:
        """See `Events.node`."""
        if there:
            self._nodes[node] = None
            self._same_names.appeared(node)
        else:
            self._nodes.pop(node, None)
            self._same_names.vanished(node)
        self._graph.changed()

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        """See `Events.appeared`."""
        if not self._open:
            self._early.append(lambda: self.appeared(endpoint))
            return
        self._endpoints[endpoint.gid] = endpoint
        (self._topics if endpoint.kind in TOPICS else self._services).appeared(endpoint)
        if endpoint.kind is EndpointKind.SERVER:
            self._actions.appeared(endpoint)

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        """See `Events.vanished`."""
        if not self._open:
            self._early.append(lambda: self.vanished(endpoint))
        else:
            self._gone(endpoint)

    def _gone(self, endpoint: RemoteEndpoint) -> None:
        del self._endpoints[endpoint.gid]
        (self._topics if endpoint.kind in TOPICS else self._services).vanished(endpoint)
        if endpoint.kind is EndpointKind.SERVER:
            self._actions.vanished(endpoint)

    def wanted(self, publisher: PublisherHere) -> None:
        """See `Events.wanted`."""
        self._topics.wanted(publisher)
        self._stats.wanted(publisher)

    def liveliness(self, gid: bytes) -> None:
        """See `Events.liveliness`."""
        self._topics.liveliness(gid)

    def link(self, session: str, up: bool) -> None:
        """See `Events.link`."""
        self._graph.changed()

    def told(self, data: bytes) -> None:
        """See `Events.told`."""
        if self._open:
            self._cycles.told(data)

    def lost(self, taker: Any, messages: int) -> None:
        """See `Events.lost`."""
        self._topics.lost(taker, messages)

    def unreadable(self, what: str, place: str, error: Exception, **fields: Any) -> None:
        """See `Events.unreadable`."""
        self._side.unreadable.note(what, place, error, **fields)

    def _nodes_elsewhere(self) -> Iterator[NodeElsewhere]:
        links = {link.session: link for link in self._transport.report()}
        for node in tuple(self._nodes):
            link = links.get(node.session)
            host, process = ("", 0) if link is None else (link.host, link.process)
            yield NodeElsewhere(node.fqn, host, process, node.session)
