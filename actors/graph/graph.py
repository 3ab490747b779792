"""Who is where: the topics, services and actions of one system, and which endpoints match.

The graph of a system lives in its event loop; all changes are immediate. Endpoints match when their types are the same and the
offered quality of service satisfies the requested one; a pair that does not match is reported once, on both sides.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar

from actors.qos import compatible

if TYPE_CHECKING:
    from actors.actions.server import ActionServer  # noqa: F401  # in a quoted base class
    from actors.interfaces.message import Message
    from actors.qos import Compatibility
    from actors.qos.policies import QoS
    from actors.services.services import Server  # noqa: F401  # in a quoted base class
    from actors.topics.channel import Publisher, Subscription

__all__ = ["ActionEntry", "Graph", "Participant", "ServerEntry", "ServiceEntry", "Tap", "TopicEntry"]

S = TypeVar("S")

DEPARTED: Final = 256

verdict_on: Final = lru_cache(maxsize=1024)(compatible)
"""`compatible`, remembered: a topic has many pairs of endpoints and few pairs of profiles."""

Tap = Callable[["Publisher[Any]"], Callable[[Any], None]]
"""Gives, for a publisher, what takes each of its messages; see `Graph.tap`."""


class Participant(Protocol):
    """What the graph asks of a node."""

    @property
    def fqn(self) -> str: ...

    def warn(self, event: str, **fields: object) -> None: ...


class TopicEntry:
    """One topic of the graph, by its full name."""

    __slots__ = ("graph", "mismatches", "name", "opened", "readers", "sent", "writers")

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.writers: dict[Publisher[Any], None] = {}
        self.readers: dict[Subscription[Any], None] = {}
        self.opened: float | None = None
        """When the first publisher came, seconds on the system's clock."""
        self.sent = 0
        """Messages of publishers that have left."""
        self.mismatches: dict[tuple[str, str, str], str] = {}
        """(publishing node, subscribing node, kind) -> what keeps this pair apart."""

    def __repr__(self) -> str:
        return f"<topic {self.name}: {len(self.writers)} publishers, {len(self.readers)} subscriptions>"

    @property
    def publishers(self) -> list[Publisher[Any]]:
        """The publishers as they are now, in the order in which they came."""
        return list(self.writers)

    @property
    def subscriptions(self) -> list[Subscription[Any]]:
        """The subscriptions as they are now, in the order in which they came."""
        return list(self.readers)

    @property
    def message_count(self) -> int:
        """Messages published on this topic so far."""
        return self.sent + sum(publisher.count for publisher in self.publishers)

    @property
    def dropped(self) -> int:
        """Messages that present subscriptions lost because they were too slow."""
        return sum(queue.dropped for queue in self.subscriptions)

    @property
    def type_names(self) -> tuple[str, ...]:
        """The ROS type names in use here, normally one."""
        types: list[type[Message]] = [publisher.type for publisher in self.publishers]
        types += [queue.type for queue in self.subscriptions]
        return tuple(sorted({type.__ros_type__ for type in types}))

    def forget(self, node: str) -> None:
        """`node` will not come back: nothing here speaks of it any more, and a topic that nobody else uses is none."""
        if self.mismatches:
            self.mismatches = {pair: why for pair, why in self.mismatches.items() if node not in pair[:2]}
        if not self.writers and not self.readers and self.graph.topics.get(self.name) is self:
            del self.graph.topics[self.name]

    def add_publisher(self, publisher: Publisher[Any]) -> None:
        if self.opened is None:
            self.opened = self.graph.now()
        self.writers[publisher] = None
        for queue in self.subscriptions:
            if queue in self.readers and self._match(publisher, queue):
                publisher.join(queue)
                queue.join(publisher)
        for tap in self.graph.taps:
            publisher.tapped(tap(publisher))
        self.graph.changed()

    def remove_publisher(self, publisher: Publisher[Any]) -> None:
        if publisher in self.writers:
            del self.writers[publisher]
            self.sent += publisher.count
            for queue in publisher.leave():
                queue.tell()
            self.graph.changed()

    def add_subscription(self, queue: Subscription[Any]) -> None:
        """Join, and receive what matching latched publishers hold, oldest first and before anything new."""
        self.graph.derive_topic(self)
        self.readers[queue] = None
        for publisher in self.publishers:
            if self._match(publisher, queue):
                publisher.join(queue)
                queue.join(publisher)
                if queue.qos.transient_local and publisher.history:
                    publisher.replay(queue)
        self.graph.changed()

    def remove_subscription(self, queue: Subscription[Any]) -> None:
        if queue in self.readers:
            del self.readers[queue]
            for publisher in self.publishers:
                publisher.part(queue)
            self.graph.changed()

    def _match(self, publisher: Publisher[Any], queue: Subscription[Any]) -> bool:
        """Whether messages flow between the two; if not, both sides hear of it."""
        if publisher.type is not queue.type and publisher.type.__ros_type__ != queue.type.__ros_type__:
            self._types_differ(publisher, queue)
            return False
        if publisher.qos is queue.qos:
            return True
        verdict = verdict_on(publisher.qos, queue.qos)
        if verdict.level == "error":
            self._qos_differs(publisher, queue, verdict)
            return False
        return True

    def _first_of_its_kind(self, publisher: Publisher[Any], queue: Subscription[Any], kind: str, why: str) -> bool:
        """Remember what keeps two nodes apart; whether that is news, and worth a line in the log."""
        pair = (publisher.node.fqn, queue.node.fqn, kind)
        news = pair not in self.mismatches
        self.mismatches.setdefault(pair, why)
        return news

    def _qos_differs(self, publisher: Publisher[Any], queue: Subscription[Any], verdict: Compatibility) -> None:
        for end in (publisher, queue):
            met = end.happening()
            met.incompatible_qos += 1
            met.last_policy = verdict.event_policy
            met.tell()
        if not self._first_of_its_kind(publisher, queue, "qos", verdict.reason):
            return
        told = {
            "offered": repr(publisher.qos),
            "requested": repr(queue.qos),
            "why": verdict.reason,
            "remedy": remedy(publisher.qos, queue.qos, verdict),
        }
        publisher.node.warn(
            f"New subscription discovered on topic '{self.name}', requesting incompatible QoS. No messages will be sent to it. "
            f"Last incompatible policy: {verdict.event_policy}",
            subscriber=queue.node.fqn,
            **told,
        )
        queue.node.warn(
            f"New publisher discovered on topic '{self.name}', offering incompatible QoS. No messages will be received from it. "
            f"Last incompatible policy: {verdict.event_policy}",
            publisher=publisher.node.fqn,
            **told,
        )

    def _types_differ(self, publisher: Publisher[Any], queue: Subscription[Any]) -> None:
        for end in (publisher, queue):
            met = end.happening()
            met.incompatible_type += 1
            met.tell()
        theirs, ours = publisher.type.__ros_type__, queue.type.__ros_type__
        why = f"it is published as {theirs} and subscribed as {ours}: one topic has one type"
        if self._first_of_its_kind(publisher, queue, "type", why):
            for node in (publisher.node, queue.node):
                node.warn(
                    f"Incompatible types on topic '{self.name}'",
                    publisher=publisher.node.fqn,
                    subscriber=queue.node.fqn,
                    why=why,
                    remedy="give one of the two topics another name, or both sides the same type",
                )


def remedy(offered: QoS, requested: QoS, verdict: Compatibility) -> str:
    """What to change so that the two match, one clause for each policy that keeps them apart."""
    fields = {"liveliness_lease_duration": "liveliness_lease"}
    clauses: list[str] = []
    for policy in verdict.policies:
        field = fields.get(policy, policy)
        offer, request = getattr(offered, field), getattr(requested, field)
        clauses.append(
            f"let the publisher offer {field}={_said(request)}, or the subscription request {field}={_said(offer)}"
        )
    return "; ".join(clauses)


def _said(policy: object) -> str:
    return f"{policy:g}" if isinstance(policy, float) else str(policy)


class ServerEntry(Generic[S]):
    """One service or action name of the graph: at most one server in this process, and who waits for one."""

    __slots__ = ("clients", "graph", "name", "restarting", "server", "stopped", "waiters")

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.server: S | None = None
        self.restarting: tuple[str, int] | None = None
        """(node, incarnation) of a server whose node has ended and will be started again."""
        self.stopped: str | None = None
        """The node that used to serve this and has stopped for good."""
        self.clients: dict[str, int] = {}
        """The nodes that ask here; for an action, how many goals each one started."""
        self.waiters: list[asyncio.Future[None]] = []

    def open(self, server: S) -> None:
        self.server = server
        self.restarting = self.stopped = None
        for waiter in self.waiters:
            if not waiter.done():
                waiter.set_result(None)
        self.waiters.clear()
        self.graph.changed()

    def pause(self, node: str, incarnation: int) -> None:
        """The server's node has ended; nobody knows yet whether for good."""
        self.server = None
        self.restarting = (node, incarnation)
        self.graph.changed()

    def close(self, node: str) -> None:
        """The server's node has ended for good."""
        self.server = None
        self.restarting = None
        self.stopped = node
        self.graph.changed()

    def forget(self, node: str) -> None:
        """`node` will not come back: it is no client any more, and a name that nobody serves or waits for is none."""
        self.clients.pop(node, None)
        served = self.stopped == node or self.name.startswith(f"{node}/")
        absent = self.server is None and self.restarting is None and not self.waiters
        if absent and (served or not self.clients):
            self.graph.drop(self)

    async def available(self) -> None:
        """Wait until there is a server."""
        while self.server is None:
            waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
            self.waiters.append(waiter)
            try:
                await waiter
            finally:
                if waiter in self.waiters:
                    self.waiters.remove(waiter)


class ServiceEntry(ServerEntry["Server"]):
    __slots__ = ()

    async def available(self) -> None:
        self.graph.derive_service(self)
        await super().available()


class ActionEntry(ServerEntry["ActionServer"]):
    __slots__ = ()


def _underived(entry: object) -> None:
    """Where nobody derives endpoints."""


def _entrance(queue: Subscription[Any]) -> Callable[[Any], None]:
    return queue.inlet


class Graph:
    """All names of one system. Names are full names; the nodes expand and remap before they ask."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self.topics: dict[str, TopicEntry] = {}
        self.services: dict[str, ServiceEntry] = {}
        self.actions: dict[str, ActionEntry] = {}
        self.departed: dict[str, str] = {}
        """Who served a name that has left the graph with its server, for the newest `DEPARTED` of them."""
        self.version = 0
        """Grows with every change."""
        self.derive_service: Callable[[ServiceEntry], None] = _underived
        self.derive_topic: Callable[[TopicEntry], None] = _underived
        self.taps: list[Tap] = []
        self.entrance: Callable[[Subscription[Any]], Callable[[Any], None]] = _entrance
        """What publishers call to reach a subscription: always the same for the same one. Simulated faults stand here."""
        self._listeners: list[Callable[[], None]] = []

    def __repr__(self) -> str:
        return f"<graph of {len(self.topics)} topics, {len(self.services)} services, {len(self.actions)} actions>"

    def topic(self, name: str) -> TopicEntry:
        entry = self.topics.get(name)
        if entry is None:
            entry = self.topics[name] = TopicEntry(self, name)
        return entry

    def service(self, name: str) -> ServiceEntry:
        entry = self.services.get(name)
        if entry is None:
            entry = self.services[name] = ServiceEntry(self, name)
            entry.stopped = self.departed.pop(name, None)
        return entry

    def action(self, name: str) -> ActionEntry:
        entry = self.actions.get(name)
        if entry is None:
            entry = self.actions[name] = ActionEntry(self, name)
            entry.stopped = self.departed.pop(name, None)
        return entry

    def drop(self, entry: ServerEntry[Any]) -> None:
        """Take out a name that nobody serves or waits for; who asks for it soon still hears at once that its server has stopped."""
        for registry in (self.services, self.actions):
            if registry.get(entry.name) is entry:
                del registry[entry.name]
        if entry.stopped is not None:
            self.departed[entry.name] = entry.stopped
            if len(self.departed) > DEPARTED:
                del self.departed[next(iter(self.departed))]

    def tap(self, tap: Tap) -> None:
        """Hand every message of every publisher, present and future, to what `tap(publisher)` returns, for as long as the graph lasts.

        A tap is no subscription: it matches every type and quality of service, nobody sees, counts or waits for it, and a run is the
        same with it and without. What `tap` returns must not raise.
        """
        self.taps.append(tap)
        for entry in self.topics.values():
            for publisher in entry.publishers:
                publisher.tapped(tap(publisher))

    def changed(self) -> None:
        """Count a change and tell the listeners."""
        self.version += 1
        for listener in tuple(self._listeners):
            listener()

    def on_change(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after every change; the returned function ends that. Calling it twice is fine."""
        self._listeners.append(listener)

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return leave
