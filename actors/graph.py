"""Who is where: the topics, services and actions of one system, and which endpoints match.

The graph of a system lives in its event loop; all changes are immediate. Endpoints match when their types are the same and the
offered quality of service satisfies the requested one; a pair that does not match is reported once, on both sides.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar

from actors.qos import compatible

if TYPE_CHECKING:
    from actors.actions import ActionServer  # noqa: F401  # in a quoted base class
    from actors.channel import Publisher, Queue
    from actors.interfaces.message import Message
    from actors.services import Server  # noqa: F401  # in a quoted base class

__all__ = ["ActionEntry", "Graph", "Participant", "ServerEntry", "ServiceEntry", "TopicEntry"]

S = TypeVar("S")


class Participant(Protocol):
    """What the graph asks of a node."""

    @property
    def fqn(self) -> str: ...

    def warn(self, event: str, **fields: object) -> None: ...


class TopicEntry:
    """One topic of the graph, by its full name."""

    __slots__ = ("graph", "mismatches", "name", "opened", "publishers", "sent", "subscriptions")

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.publishers: list[Publisher[Any]] = []
        self.subscriptions: list[Queue[Any]] = []
        self.opened: float | None = None
        """When the first publisher came, seconds on the system's clock."""
        self.sent = 0
        """Messages of publishers that have left."""
        self.mismatches: dict[tuple[str, str, str], str] = {}
        """(publishing node, subscribing node, kind) -> what keeps this pair apart."""

    def __repr__(self) -> str:
        return f"<topic {self.name}: {len(self.publishers)} publishers, {len(self.subscriptions)} subscriptions>"

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

    def add_publisher(self, publisher: Publisher[Any]) -> None:
        if self.opened is None:
            self.opened = self.graph.now()
        publisher.targets = tuple(queue.deliver for queue in self.matched(publisher))
        self.publishers.append(publisher)
        self.graph.changed()

    def remove_publisher(self, publisher: Publisher[Any]) -> None:
        if publisher in self.publishers:
            self.publishers.remove(publisher)
            self.sent += publisher.count
            publisher.targets = ()
            self.graph.changed()

    def add_subscription(self, queue: Queue[Any]) -> None:
        """Join, and receive what matching latched publishers hold, oldest first and before anything new."""
        self.graph.derive_topic(self)
        self.subscriptions.append(queue)
        deliver = queue.deliver
        for publisher in self.publishers:
            if self.match(publisher, queue):
                publisher.targets += (deliver,)
                if queue.qos.transient_local and publisher.history:
                    for message in list(publisher.history)[-queue.depth :]:
                        deliver(message)
        self.graph.changed()

    def remove_subscription(self, queue: Queue[Any]) -> None:
        if queue in self.subscriptions:
            self.subscriptions.remove(queue)
            gone = queue.deliver
            for publisher in self.publishers:
                if gone in publisher.targets:
                    publisher.targets = tuple(deliver for deliver in publisher.targets if deliver != gone)
            self.graph.changed()

    def matched(self, publisher: Publisher[Any]) -> list[Queue[Any]]:
        """The subscriptions that `publisher` reaches, in subscription order."""
        return [queue for queue in self.subscriptions if self.match(publisher, queue)]

    def publishers_matched(self, queue: Queue[Any]) -> int:
        """How many publishers reach `queue`."""
        return sum(self.match(publisher, queue) for publisher in self.publishers)

    def match(self, publisher: Publisher[Any], queue: Queue[Any]) -> bool:
        """Whether messages flow between the two; the first failure of a pair is reported on both sides."""
        if publisher.type is not queue.type and publisher.type.__ros_type__ != queue.type.__ros_type__:
            theirs, ours = publisher.type.__ros_type__, queue.type.__ros_type__
            self._apart(
                publisher,
                queue,
                "type",
                f"it is published as {theirs} and subscribed as {ours}: one topic has one type",
            )
            return False
        if publisher.qos is queue.qos:
            return True
        verdict = compatible(publisher.qos, queue.qos)
        if verdict.level == "error":
            self._apart(publisher, queue, "qos", verdict.reason, policy=verdict.event_policy)
            return False
        return True

    def _apart(self, publisher: Publisher[Any], queue: Queue[Any], kind: str, why: str, policy: str = "") -> None:
        pair = (publisher.node.fqn, queue.node.fqn, kind)
        if pair in self.mismatches:
            return
        self.mismatches[pair] = why
        if kind == "qos":
            publisher.node.warn(
                f"New subscription discovered on topic '{self.name}', requesting incompatible QoS. No messages will be sent to it. "
                f"Last incompatible policy: {policy}",
                subscriber=queue.node.fqn,
                why=why,
                remedy="give both ends the same profile",
            )
            queue.node.warn(
                f"New publisher discovered on topic '{self.name}', offering incompatible QoS. No messages will be received from it. "
                f"Last incompatible policy: {policy}",
                publisher=publisher.node.fqn,
                why=why,
                remedy="give both ends the same profile",
            )
        else:
            for node in (publisher.node, queue.node):
                node.warn(
                    f"Incompatible types on topic '{self.name}'",
                    publisher=publisher.node.fqn,
                    subscriber=queue.node.fqn,
                    why=why,
                )


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


class Graph:
    """All names of one system. Names are full names; the nodes expand and remap before they ask."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self.topics: dict[str, TopicEntry] = {}
        self.services: dict[str, ServiceEntry] = {}
        self.actions: dict[str, ActionEntry] = {}
        self.version = 0
        """Grows with every change."""
        self.derive_service: Callable[[ServiceEntry], None] = _underived
        self.derive_topic: Callable[[TopicEntry], None] = _underived
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
        return entry

    def action(self, name: str) -> ActionEntry:
        entry = self.actions.get(name)
        if entry is None:
            entry = self.actions[name] = ActionEntry(self, name)
        return entry

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
