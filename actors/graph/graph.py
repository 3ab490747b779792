"""The graph of one system: its topics, services and actions by name, with their endpoints.

The graph belongs to one event loop, and every change takes effect immediately. A publisher and a subscription match if their types are the
same and the offered quality of service satisfies the requested one; a pair that does not match is logged once, at both nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from actors.graph.interceptor import Tap, TopicInterceptor, TopicTap
from actors.graph.mismatch import mismatch_of
from actors.graph.servers import ActionEntry, S, ServerEntry, ServiceEntry
from actors.graph.watching import GraphWatcher, KnownLink, NodeElsewhere
from actors.inbox.boundary import asked, outside
from actors.suggest import near_name

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

DEPARTED: Final = 256


class TopicEntry:
    """One topic of the graph. It is the `actors.topics.peers.TopicRegistry` of the topic's endpoints.

    Invariants:

    * A publisher and a subscription are matched, each at the other, exactly if both are registered here, one of them at least belongs to
      this process, their types are the same and the offered quality of service satisfies the requested one. This is decided once, when
      the second of them is added.
    * `mismatches` holds one entry per pair of nodes and kind of mismatch. Each was logged when it was added.
    """

    __slots__ = ("graph", "mismatches", "name", "opened", "readers", "sent", "writers")

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.writers: dict[PublisherPeer, None] = {}
        self.readers: dict[SubscriptionPeer, None] = {}
        self.opened: float | None = None
        """When the first publisher was added, in seconds on the system's clock; None before."""
        self.sent = 0
        """The number of messages published by publishers that have left."""
        self.mismatches: dict[tuple[str, str, str], str] = {}
        """(publishing node, subscribing node, kind) -> why the pair does not match."""

    def __repr__(self) -> str:
        return f"<topic {self.name}: {len(self.writers)} publishers, {len(self.readers)} subscriptions>"

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The present publishers, in the order in which they were added."""
        return list(self.writers)

    @property
    def subscriptions(self) -> list[SubscriptionPeer]:
        """The present subscriptions, in the order in which they were added."""
        return list(self.readers)

    @property
    def message_count(self) -> int:
        """The number of messages published on this topic so far."""
        return self.sent + sum(publisher.count for publisher in self.publishers)

    @property
    def dropped(self) -> int:
        """The number of messages that the present subscriptions lost because their readers were too slow."""
        return sum(subscription.dropped for subscription in self.subscriptions)

    @property
    def type_names(self) -> tuple[str, ...]:
        """The ROS type names of the topic's endpoints; normally one."""
        types: list[type[Message]] = [publisher.type for publisher in self.publishers]
        types += [subscription.type for subscription in self.subscriptions]
        return tuple(sorted({type.__ros_type__ for type in types}))

    def meant(self) -> str:
        """``; did you mean '/scan'?`` if nobody publishes here, but somebody on a topic of nearly this name; else empty."""
        return asked(self._meant)

    def _meant(self) -> str:
        if self.writers:
            return ""
        here = {one.node.fqn for one in self.subscriptions}
        last = self.name.rpartition("/")[2]

        def known(name: str, entry: TopicEntry) -> bool:
            """Whether a node that subscribes here means that topic, too: it subscribes to it, or publishes it under the same last name."""
            if not here.isdisjoint(one.node.fqn for one in entry.subscriptions):
                return True
            return name.rpartition("/")[2] == last and not here.isdisjoint(one.node.fqn for one in entry.publishers)

        others = [name for name, entry in self.graph.topics.items() if entry.writers and not known(name, entry)]
        return near_name(self.name, others)

    def forget(self, node: str) -> None:
        """Forget the mismatches of `node` once it has no endpoint here. A topic without endpoints leaves the graph."""
        if self.mismatches and all(one.node.fqn != node for one in (*self.writers, *self.readers)):
            self.mismatches = {pair: why for pair, why in self.mismatches.items() if node not in pair[:2]}
        if not self.writers and not self.readers and self.graph.topics.get(self.name) is self:
            del self.graph.topics[self.name]

    def target(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> Target:
        """Return the function that `publisher` calls to reach `subscription`: its target, behind the interceptors if the subscription
        belongs to this process."""
        target = subscription.target(publisher)
        if (
            subscription.here
        ):  # those of other processes share one target, by which a message is sent once for all of them
            for each in self.graph.interceptors:
                target = each.delivering(publisher, subscription, target)
        return target

    def outward(self, publisher: PublisherPeer, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        """Return the functions that `publisher` calls with each message: `targets`, behind the interceptors."""
        for each in reversed(self.graph.interceptors):
            targets = each.publishing(publisher, targets)
        return targets

    def add_publisher(self, publisher: PublisherPeer) -> None:
        """Add `publisher` and match it with the topic's subscriptions."""
        if self.opened is None:
            with outside():  # not a reading of the clock by the node that happens to be the first
                self.opened = self.graph.now()
        self.writers[publisher] = None
        for subscription in list(self.readers):
            # A subscription that is garbage-collected during this loop has left `readers`.
            if subscription in self.readers and self._match(publisher, subscription):
                publisher.join(subscription)
                subscription.join(publisher)
        for each in self.graph.interceptors:
            if (tap := each.tapping(publisher)) is not None:
                publisher.add_tap(tap)
        self.graph.changed()
        for watcher in self.graph.watchers:
            watcher.publisher_joined(publisher)

    def remove_publisher(self, publisher: PublisherPeer) -> None:
        """Remove `publisher` and undo its matches. Calling it twice is harmless."""
        if publisher in self.writers:
            del self.writers[publisher]
            self.sent += publisher.count
            for subscription in publisher.leave():
                subscription.part(publisher)
            self.graph.changed()
            for watcher in self.graph.watchers:
                watcher.publisher_left(publisher)

    def add_subscription(self, subscription: SubscriptionPeer) -> None:
        """Add `subscription` and match it with the topic's publishers. It receives their kept messages, oldest first, before any new
        one."""
        self.graph.open_standard_topic(self)
        self.readers[subscription] = None
        for publisher in list(self.writers):
            if self._match(publisher, subscription):
                publisher.join(subscription)
                subscription.join(publisher)
                if subscription.qos.transient_local:
                    subscription.catch_up(publisher)
        self.graph.changed()
        for watcher in self.graph.watchers:
            watcher.subscription_joined(subscription)

    def remove_subscription(self, subscription: SubscriptionPeer) -> None:
        """Remove `subscription` and undo its matches. Calling it twice is harmless."""
        if subscription in self.readers:
            del self.readers[subscription]
            for publisher in subscription.leave():
                publisher.part(subscription)
            self.graph.changed()
            for watcher in self.graph.watchers:
                watcher.subscription_left(subscription)

    def _match(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> bool:
        """Whether the two match. If not, count that at both; log it if they do not fit for the first time in this way between their nodes."""
        if not (publisher.here or subscription.here):
            return False  # that is the business of their own processes
        mismatch = mismatch_of(publisher, subscription)
        if mismatch is None:
            return True
        if not mismatch.matches:
            mismatch.count()
        pair = (publisher.node.fqn, subscription.node.fqn, mismatch.kind)
        if pair not in self.mismatches:
            self.mismatches[pair] = mismatch.why
            mismatch.warn(self.name)
        return mismatch.matches


def _has_no_standard_endpoints(entry: object) -> None:
    """Do nothing: the default for a graph without the services and topics that ROS 2 gives every node."""


class Graph:
    """The topics, services and actions of one system, by fully qualified name. Nodes expand and remap names beforehand.

    `open_standard_service` is called with a service that is needed and has no server, `open_standard_topic` with a topic before a
    subscription is added to it. They create the services and topics that ROS 2 gives every node or action; those that are never used cost
    nothing.

    Invariants:

    * A name with an endpoint, a server that runs or may be restarted, or a waiting task does not leave the graph.
    * `departed` holds the last servers of the newest `DEPARTED` served names that have left.
    * `version` increases with each call of `changed`, before the listeners are called. A server that is withdrawn and a name that leaves
      are not reported as changes.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.now: Final = now
        self.open_standard_service: Callable[[ServiceEntry], None] = _has_no_standard_endpoints
        self.open_standard_topic: Callable[[TopicEntry], None] = _has_no_standard_endpoints
        self.topics: dict[str, TopicEntry] = {}
        self.services: dict[str, ServiceEntry] = {}
        self.actions: dict[str, ActionEntry] = {}
        self.departed: dict[str, str] = {}
        """Name -> the node that served it last, for the newest `DEPARTED` served names that have left the graph."""
        self.version = 0
        """Increases with each call of `changed`."""
        self.interceptors: list[TopicInterceptor] = []
        """What stands between the ends of topics; the first is the nearest to the nodes."""
        self.watchers: list[GraphWatcher] = []
        """Told of every endpoint that joins or leaves, and of every search for a server."""
        self.elsewhere: Callable[[], Iterable[NodeElsewhere]] = tuple
        """Returns the known nodes of other processes."""
        self.complete: Callable[[], bool] = lambda: True
        """Returns whether all is known that the other processes which have been found have told of."""
        self.links: Callable[[], Iterable[KnownLink]] = tuple
        """Returns the other processes that can be reached."""
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

    def seek(self, entry: ServiceEntry) -> None:
        """Open the service `entry`, for which a node looks, if it is a standard one, and tell the watchers."""
        self.open_standard_service(entry)
        for watcher in self.watchers:
            watcher.server_sought(entry)

    def drop(self, entry: ServerEntry[S]) -> None:
        """Remove a name without server and waiting tasks. Its last server is remembered, so that a later caller learns at once that it has
        stopped."""
        name = entry.name
        for registry in (self.services, self.actions):
            if registry.get(name) is entry:
                del registry[name]
        if entry.stopped is not None:
            self.departed[entry.name] = entry.stopped
            if len(self.departed) > DEPARTED:
                del self.departed[next(iter(self.departed))]

    def tap(self, tap: Tap) -> None:
        """Pass every message of every publisher, present and future, to the function that `tap(publisher)` returns.

        A tap is not a subscription. It receives every type and quality of service, does not appear in the graph, is not counted or waited
        for, and does not change the course of a run. It stays as long as the graph. The function that `tap` returns must not raise.
        """
        self.intercept(TopicTap(tap))

    def intercept(self, interceptor: TopicInterceptor, *, first: bool = False) -> None:
        """Let `interceptor` stand between the ends of topics from now on, as long as the graph; with `first`, nearest to the nodes.

        Ends that match already go on without it, but for its taps.
        """
        self.interceptors.insert(0 if first else len(self.interceptors), interceptor)
        for entry in self.topics.values():
            for publisher in entry.publishers:
                if (tap := interceptor.tapping(publisher)) is not None:
                    publisher.add_tap(tap)

    def changed(self) -> None:
        """Increase `version` and call the listeners."""
        self.version += 1
        if self._listeners:
            with outside():
                for listener in tuple(self._listeners):
                    listener()

    def on_change(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after every change. The returned function removes it; calling that twice is harmless."""
        self._listeners.append(listener)

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return leave
