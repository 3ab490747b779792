"""Who is where: the topics, services and actions of one system, and which endpoints match.

The graph of a system lives in its event loop; all changes are immediate. Endpoints match when their types are the same and the
offered quality of service satisfies the requested one; a pair that does not match is reported once, on both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, TypeAlias, TypeVar

from actors.errors import ActionUnavailable, NodeRestarting, NotRunning, ServiceUnavailable
from actors.graph.mismatch import mismatch_of
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.actions.server import ActionServer  # noqa: F401  # in a quoted base class
    from actors.interfaces.message import Message
    from actors.services.server import Server  # in a quoted base class
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

__all__ = ["ActionEntry", "Graph", "Interceptor", "ServerEntry", "ServiceEntry", "Tap", "TopicEntry"]

S = TypeVar("S")

DEPARTED: Final = 256

Tap: TypeAlias = "Callable[[PublisherPeer], Callable[[Any], None]]"
"""A wire tap: gives, for a publisher, what takes each of its messages; see `Graph.tap`."""

Interceptor: TypeAlias = "Callable[[SubscriptionPeer, Target], Target]"
"""An interceptor: gives, for a subscription and its target, what publishers call instead. Simulated faults stand there."""


class TopicEntry:
    """One topic of the graph, by its full name: the `actors.topics.peers.TopicRegistry` of its endpoints.

    Invariants:

    * A publisher and a subscription are matched, each at the other, exactly if both are here, their types are the same and the offered
      quality of service satisfies the requested one. That is decided once, when the second of them comes.
    * `mismatches` holds each pair of nodes once for each reason; it was logged when it was entered.
    """

    __slots__ = ("graph", "mismatches", "name", "opened", "readers", "sent", "writers")

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.writers: dict[PublisherPeer, None] = {}
        self.readers: dict[SubscriptionPeer, None] = {}
        self.opened: float | None = None
        """When the first publisher came, seconds on the system's clock."""
        self.sent = 0
        """Messages of publishers that have left."""
        self.mismatches: dict[tuple[str, str, str], str] = {}
        """(publishing node, subscribing node, kind) -> what keeps this pair apart."""

    def __repr__(self) -> str:
        return f"<topic {self.name}: {len(self.writers)} publishers, {len(self.readers)} subscriptions>"

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The publishers as they are now, in the order in which they came."""
        return list(self.writers)

    @property
    def subscriptions(self) -> list[SubscriptionPeer]:
        """The subscriptions as they are now, in the order in which they came."""
        return list(self.readers)

    @property
    def message_count(self) -> int:
        """Messages published on this topic so far."""
        return self.sent + sum(publisher.count for publisher in self.publishers)

    @property
    def dropped(self) -> int:
        """Messages that present subscriptions lost because they were too slow."""
        return sum(subscription.dropped for subscription in self.subscriptions)

    @property
    def type_names(self) -> tuple[str, ...]:
        """The ROS type names in use here, normally one."""
        types: list[type[Message]] = [publisher.type for publisher in self.publishers]
        types += [subscription.type for subscription in self.subscriptions]
        return tuple(sorted({type.__ros_type__ for type in types}))

    def forget(self, node: str) -> None:
        """`node` will not come back: nothing here names it any more, and a topic that nobody else uses leaves the graph."""
        if self.mismatches:
            self.mismatches = {pair: why for pair, why in self.mismatches.items() if node not in pair[:2]}
        if not self.writers and not self.readers and self.graph.topics.get(self.name) is self:
            del self.graph.topics[self.name]

    def target(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> Target:
        """What `publisher` calls to reach `subscription`: its target, or what the graph's interceptor puts in front of it."""
        target, intercept = subscription.target(publisher), self.graph.intercept
        return target if intercept is None else intercept(subscription, target)

    def add_publisher(self, publisher: PublisherPeer) -> None:
        """Match `publisher` with the subscriptions that are here."""
        if self.opened is None:
            self.opened = self.graph.now()
        self.writers[publisher] = None
        for subscription in self.subscriptions:
            # one that is collected while its publisher comes leaves during this loop
            if subscription in self.readers and self._match(publisher, subscription):
                publisher.join(subscription)
                subscription.join(publisher)
        for tap in self.graph.taps:
            publisher.add_tap(tap(publisher))
        self.graph.changed()

    def remove_publisher(self, publisher: PublisherPeer) -> None:
        """Part `publisher` from its subscriptions. Twice is fine."""
        if publisher in self.writers:
            del self.writers[publisher]
            self.sent += publisher.count
            for subscription in publisher.leave():
                subscription.part(publisher)
            self.graph.changed()

    def add_subscription(self, subscription: SubscriptionPeer) -> None:
        """Match `subscription` with the publishers that are here; it gets what they have latched, oldest first and before anything new."""
        self.graph.open_standard_topic(self)
        self.readers[subscription] = None
        for publisher in self.publishers:
            if self._match(publisher, subscription):
                publisher.join(subscription)
                subscription.join(publisher)
                if subscription.qos.transient_local:
                    subscription.catch_up(publisher)
        self.graph.changed()

    def remove_subscription(self, subscription: SubscriptionPeer) -> None:
        """Part `subscription` from its publishers. Twice is fine."""
        if subscription in self.readers:
            del self.readers[subscription]
            for publisher in subscription.leave():
                publisher.part(subscription)
            self.graph.changed()

    def _match(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> bool:
        """Whether messages flow between the two. If not, both sides count it, and log it if it is new."""
        mismatch = mismatch_of(publisher, subscription)
        if mismatch is None:
            return True
        mismatch.count()
        pair = (publisher.node.fqn, subscription.node.fqn, mismatch.kind)
        if pair not in self.mismatches:
            self.mismatches[pair] = mismatch.why
            mismatch.warn(self.name)
        return False


class ServerEntry(Generic[S]):
    """One service or action name of the graph: at most one server in this process, and the tasks that wait for one.

    Invariants:

    * At most one of `server`, `restarting` and `stopped` is set; none of them before the first server comes.
    * While there is a `server`, nobody is in `waiters`.
    * `graph` holds this entry by its name until it is dropped; a dropped entry is not used again, except to find its successor (`current`).
    """

    __slots__ = ("clients", "graph", "name", "restarting", "server", "stopped", "waiters")

    kind: ClassVar[str]
    """service or action."""
    missing: ClassVar[type[ServiceUnavailable] | type[ActionUnavailable]]
    """The error of a caller for whom no server came in time."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.server: S | None = None
        self.restarting: tuple[str, int] | None = None
        """(node, incarnation) of a server whose node has ended and will be started again."""
        self.stopped: str | None = None
        """The node that used to serve this and has stopped for good."""
        self.clients: dict[str, int] = {}
        """The nodes that are clients here; for an action, how many goals each one started."""
        self.waiters = Waiters()

    def open(self, server: S) -> None:
        """`server` serves this name from now on."""
        self.server = server
        self.restarting = self.stopped = None
        self.waiters.wake_all()
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

    def withdraw(self) -> None:
        """The server has gone, and may be opened again when somebody asks for it."""
        self.server = None

    def forget(self, node: str) -> None:
        """`node` will not come back: it is no client any more, and a name that nobody serves or waits for leaves the graph."""
        self.clients.pop(node, None)
        served = self.stopped == node or self.name.startswith(f"{node}/")
        absent = self.server is None and self.restarting is None and not self.waiters
        if absent and (served or not self.clients):
            self.graph.drop(self)

    async def available(self) -> S:
        """The server; waits until there is one."""
        while self.server is None:
            await self.waiters.wait()
        return self.server

    async def require(self) -> S:
        """The server; waits for the first one, but not for one that has ended.

        Raises `NodeRestarting` between two lives of its node, and `NotRunning` when its node has stopped for good.
        """
        if self.server is None:
            if self.restarting is not None:
                raise NodeRestarting(*self.restarting)
            if self.stopped is not None:
                raise NotRunning(
                    f"{self.stopped}, which served {self.name}, has stopped: start it again, or ask another {self.kind}"
                )
        return await self.available()

    def unavailable(self, seconds: float, type: str = "") -> ServiceUnavailable | ActionUnavailable:
        """The error of a caller for whom no server, of the named type, came within `seconds`."""
        asked = f"{self.name} [{type}]" if type else self.name
        return self.missing(
            f"nobody serves {asked} after {seconds:g} s: start its node, or check the name and namespace"
        )


class ServiceEntry(ServerEntry["Server"]):
    """One service name of the graph."""

    __slots__ = ()
    kind = "service"
    missing = ServiceUnavailable

    @property
    def current(self) -> ServiceEntry:
        """This entry, or the one by its name that has come into the graph after this one had left it."""
        return self.graph.services.get(self.name, self)

    async def available(self) -> Server:
        self.graph.open_standard_service(self)
        return await super().available()

    async def require(self) -> Server:
        self.graph.open_standard_service(self)
        return await super().require()


class ActionEntry(ServerEntry["ActionServer"]):
    """One action name of the graph."""

    __slots__ = ()
    kind = "action"
    missing = ActionUnavailable


def _has_no_standard_endpoints(entry: object) -> None:
    """For a graph without the endpoints that ROS 2 gives every node."""


class Graph:
    """All names of one system. Names are full names; the nodes expand and remap before they ask.

    `open_standard_service` is called with a service that somebody needs and nobody serves, `open_standard_topic` with a topic before a
    subscription joins it: they open it if it is one of those that ROS 2 gives every node or action, so that nobody pays for the others.
    `intercept` is put between publishers and subscriptions.

    Invariants:

    * A name stays while somebody serves, uses or waits for it. `departed` remembers the newest `DEPARTED` servers whose names have left.
    * `version` grows with every change, and the listeners are called after it.
    """

    def __init__(
        self,
        now: Callable[[], float],
        *,
        open_standard_service: Callable[[ServiceEntry], None] = _has_no_standard_endpoints,
        open_standard_topic: Callable[[TopicEntry], None] = _has_no_standard_endpoints,
        intercept: Interceptor | None = None,
    ) -> None:
        self.now: Final = now
        self.open_standard_service: Final = open_standard_service
        self.open_standard_topic: Final = open_standard_topic
        self.intercept: Final = intercept
        self.topics: dict[str, TopicEntry] = {}
        self.services: dict[str, ServiceEntry] = {}
        self.actions: dict[str, ActionEntry] = {}
        self.departed: dict[str, str] = {}
        """Who served a name that has left the graph with its server, for the newest `DEPARTED` of them."""
        self.version = 0
        """Grows with every change."""
        self.taps: list[Tap] = []
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

        It is a wire tap and no subscription: it matches every type and quality of service, nobody sees, counts or waits for it, and a run
        is the same with it and without. What `tap` returns must not raise.
        """
        self.taps.append(tap)
        for entry in self.topics.values():
            for publisher in entry.publishers:
                publisher.add_tap(tap(publisher))

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
