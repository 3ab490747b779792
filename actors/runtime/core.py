"""The machinery behind one life of a node: its endpoints, timers, tasks, and their orderly end.

`Node` is what people write, `Core` is what runs it. A core belongs to one incarnation; the `Mailbox` it works from outlives it.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from actors.actions.client import Goal
from actors.actions.server import ActionServer
from actors.errors import DeclarationError
from actors.inbox.inbox import Item
from actors.names.identity import Identity
from actors.parameters.hooks import attach_hooks
from actors.parameters.rates import guard_rates
from actors.places import awaited_in
from actors.qos import (
    ACTION_FEEDBACK,
    ACTION_STATUS,
    DEFAULT,
    PARAMETER_EVENTS,
    ROSOUT,
    resolve_publisher,
    resolve_subscription,
)
from actors.qos.policies import QoS
from actors.runtime.ground import Ground
from actors.runtime.mailbox import Mailbox
from actors.runtime.timers import NodeTimer, TimerRecord
from actors.services.client import Client
from actors.services.server import Server
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.timed_publisher import publisher_for

if TYPE_CHECKING:
    from actors.contracts.contracts import Action, Service, Topic
    from actors.graph.graph import ActionEntry, TopicEntry
    from actors.interfaces.message import Message
    from actors.node.declarations import Declarations
    from actors.node.node import Node
    from actors.parameters import ParameterChange, ParameterStore
    from actors.runtime.sim_time import SimTime
    from actors.runtime.timers import TickSource
    from actors.system import System
    from actors.topics.handler import Handler
    from actors.topics.publisher import Publisher

__all__ = ["Core"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")


_EVENT_QOS: Final = {
    "parameter_events": PARAMETER_EVENTS,
    "rosout": ROSOUT,
    "status": ACTION_STATUS,
    "feedback": ACTION_FEEDBACK,
}


CLIENTS: Final = 256
"""So many services a node remembers its way to; it finds it again when it has forgotten it."""


class Core(Ground):
    """One incarnation of one node in one system."""

    __slots__ = (
        "_parameters",
        "clients",
        "declarations",
        "derived",
        "publishers",
        "publishing",
        "sim",
        "streams",
        "timers",
    )

    def __init__(
        self, system: System, node: Node, declarations: Declarations, identity: Identity, mailbox: Mailbox
    ) -> None:
        if mailbox.core is not None:  # one that refused to die: nothing of it may go on under the new one's name
            mailbox.core.release()
        mailbox.core = self
        super().__init__(system, node, identity, mailbox)
        self.declarations = declarations
        self.publishers: list[Publisher[Any]] = []
        self.streams: list[StreamSubscription[Any]] = []
        self.timers: list[NodeTimer] = []
        self.derived: list[Server] = []
        """Services that ROS 2 gives every node, as far as somebody asked for them."""
        self.publishing = True
        self.sim: SimTime | None = None
        self.clients: dict[Any, Client[Any, Any]] = {}
        self._parameters: ParameterStore | None = None

    # -- parameters ----------------------------------------------------------------------------------------------------------

    @property
    def parameters(self) -> ParameterStore:
        return self._parameters or self._open_store(None)

    def open_parameters(self) -> None:
        """Check the overrides, and tell who listens what the node has. Otherwise the store is made at its first use."""
        if self.identity.overrides or self.system.on_parameters is not None:
            self._open_store(self._parameters_changed)

    def _open_store(self, told: Callable[[ParameterChange], None] | None) -> ParameterStore:
        from actors.parameters import ParameterStore

        declarations = self.declarations
        store = ParameterStore(
            self.fqn,
            self.identity.overrides,
            table=declarations.table,
            allow_undeclared=self.node.allow_undeclared_parameters,
            on_event=told,
        )
        store.on_event = self._parameters_changed  # for who listens only later
        self._parameters = store  # the hooks may read what they are asked about
        if declarations.rates:
            guard_rates(store, declarations.rates)
        if declarations.parameter_hooks:
            attach_hooks(store, self.node, declarations.parameter_hooks)
        store.check_overrides()
        return store

    def _parameters_changed(self, change: ParameterChange) -> None:
        for parameter in change.changed:
            if parameter.name == "use_sim_time":
                self.ros_time().use(parameter.value is True)
            elif parameter.name in self.declarations.rates:
                self._retime(parameter.name, parameter.value)
        if self.system.on_parameters is not None:
            self.system.on_parameters(self, change)

    def ros_time(self) -> SimTime:
        """This incarnation's ROS time, made at its first use; its clock is the node's from then on."""
        if self.sim is None:
            from actors.runtime.sim_time import SimTime

            self.sim = SimTime(self)
            self.clock = self.sim.clock
        return self.sim

    # -- making endpoints ---------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]:
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        offered = resolve_publisher(qos, [one.qos for one in entry.subscriptions])
        publisher = publisher_for(self, entry, topic.type, offered)
        self.publishers.append(publisher)
        entry.add_publisher(publisher)
        if not self.publishing:
            publisher.suspend()
        return publisher

    def subscribe(self, topic: Topic[M], qos: QoS) -> Stream[M]:
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        requested = resolve_subscription(qos, [one.qos for one in entry.publishers])
        subscription = StreamSubscription(self, entry, topic.type, requested, self._stream_closed)
        self.streams.append(subscription)
        entry.add_subscription(subscription)
        return Stream(subscription, self.system.loop)

    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]:
        """What feeds this incarnation's first handler of `topic`."""
        name = self.identity.topic(topic.name)
        for feed in self.mailbox.feeds:
            if feed.node is self and feed.entry.name == name:
                return feed
        raise DeclarationError(f"{self.fqn} has no handler of {name}: declare one with @{topic!r}.on()")

    def _stream_closed(self, subscription: StreamSubscription[Any]) -> None:
        self.streams.remove(subscription)
        self.mailbox.note((subscription.entry,))

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        """The way to a service that is not among `clients` yet."""
        if len(self.clients) >= CLIENTS:  # its contracts are made by the dozen
            self.mailbox.note(one.entry for one in self.clients.values())
            self.clients.clear()
        entry = self.system.graph.service(self.identity.service(service.name))
        client = self.clients[service] = Client(self, entry, service)
        entry.clients[self.fqn] = entry.clients.get(self.fqn, 0)
        return client

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        entry = self.system.graph.action(self.identity.service(action.name))
        entry.clients[self.fqn] = entry.clients.get(self.fqn, 0) + 1
        self.mailbox.note((entry,))
        return Goal(self, entry, action, message, timeout)

    def feed(self, topic: Topic[M], qos: QoS, handler: Handler[M], label: str, concurrent: int = 0) -> None:
        """Let `handler` take the messages of `topic`; a subscription that is left over from the last incarnation is taken over."""
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        feed = self._left_over(entry, topic.type, label, concurrent)
        if feed is not None:
            feed.take_over(self, handler)
            return
        qos = resolve_subscription(qos, [one.qos for one in entry.publishers])
        if concurrent:
            feed = ConcurrentSubscription(self, entry, topic.type, qos, self.inbox, label, handler, concurrent)
        else:
            feed = HandlerSubscription(self, entry, topic.type, qos, self.inbox, label, handler)
        self.mailbox.feeds.append(feed)
        entry.add_subscription(feed)

    def serve_concurrently(self) -> None:
        """The node has started: begin with the messages and requests that have come meanwhile for concurrent handlers."""
        self.serving = True
        for feed in self.mailbox.feeds:
            if isinstance(feed, ConcurrentSubscription):
                feed.start(self.spawn)
        for server in self.mailbox.services.values():
            server.begin()

    def _left_over(
        self, entry: TopicEntry, type: type[M], label: str, concurrent: int
    ) -> HandlerSubscription[M] | None:
        """The first subscription of this handler that the last incarnation had and this one has not yet."""
        for feed in self.mailbox.feeds:
            same = feed.node is not self and feed.label == label and feed.entry is entry and feed.type is type
            if same and concurrent == (feed.concurrent if isinstance(feed, ConcurrentSubscription) else 0):
                return feed
        return None

    def serve(
        self,
        service: Service[Req, Resp],
        handler: Callable[[Req], Coroutine[Any, Any, Resp]],
        label: str,
        concurrent: int = 0,
    ) -> None:
        self.check_use()
        entry = self.system.graph.service(self.identity.service(service.name))
        if entry.server is not None:
            self._refuse_second(entry.server, "service", entry.server.type, service.type)
        server = Server(self, entry, service.type, handler, label, concurrent)
        self.mailbox.services[entry.name] = server
        entry.open(server)

    def serve_action(self, entry: ActionEntry, server: ActionServer) -> None:
        if entry.server is not None:
            self._refuse_second(entry.server, "action", entry.server.type, server.type)
        self.mailbox.actions[entry.name] = server
        entry.open(server)
        graph = self.system.graph
        for part in ("status", "feedback"):  # who listened to the last incarnation's hears this one's
            topic = graph.topics.get(f"{entry.name}/_action/{part}")
            if topic is not None and topic.subscriptions:
                graph.open_standard_topic(topic)

    def _refuse_second(
        self, first: Server | ActionServer, kind: str, served: type[Any], offered: type[Any]
    ) -> NoReturn:
        served_type, offered_type = served.__ros_type__, offered.__ros_type__
        types = f" as {served_type}, not as {offered_type}" if served_type != offered_type else ""
        raise DeclarationError(
            f"{self.fqn} would be the second server of {kind} {first.entry.name}, which {first.node.fqn} serves already{types}: "
            "give one of them another name or namespace"
        )

    # -- timers and publishing ------------------------------------------------------------------------------------------------

    def start_timers(self) -> None:
        """Let every `@every` of the class tick from now on."""
        node, labels = self.node, self.declarations.labels
        for timer in self.declarations.timers:
            hz = self.parameters.value(timer.hz) if isinstance(timer.hz, str) else timer.hz
            record = self.mailbox.timers.get(timer.attribute)
            if record is None:
                record = self.mailbox.timers[timer.attribute] = TimerRecord(hz)
            record.hz = hz
            handler, label = getattr(node, timer.attribute), labels[timer.attribute]
            item = NodeTimer(self.inbox, handler, hz, timer.late, label, record)
            self.timers.append(item)
            if self.system.stalls is not None:
                item.on_late = self.on_late
            if self.sim is None:
                item.begin(self.system.ticker)
            else:
                self.sim.begin(item)

    def _retime(self, name: str, hz: float) -> None:
        """The parameter `name` has been set: what ticks by it ticks at the new rate from now on."""
        ticker: TickSource = self.system.ticker
        if self.sim is not None and self.sim.ros.active:
            ticker = self.sim.ticker
        for declared, timer in zip(self.declarations.timers, self.timers, strict=False):  # none while they rest
            if declared.hz == name and timer.hz != hz:
                timer.retime(hz, ticker)

    def stop_timers(self) -> None:
        for timer in self.timers:
            timer.stop()
        self.timers.clear()

    def let_publish(self, allowed: bool) -> None:
        """Whether the node's own publishers deliver or discard; those that ROS 2 gives every node always deliver."""
        self.publishing = allowed
        for publisher in self.publishers:
            if publisher.gated:
                if allowed:
                    publisher.resume()
                else:
                    publisher.suspend()

    def event_publisher(self, type: type[M], entry: TopicEntry) -> Publisher[M]:
        """The node's publisher on a topic that ROS 2 gives every node of its kind, made at its first use."""
        for publisher in self.publishers:
            if publisher.entry is entry:
                return publisher
        publisher = publisher_for(self, entry, type, _EVENT_QOS.get(entry.name.rpartition("/")[2], DEFAULT))
        publisher.gated = False
        self.publishers.append(publisher)
        entry.add_publisher(publisher)
        return publisher

    def on_late(self, timer: NodeTimer, seconds: float, lost: int) -> None:
        """The event loop was late for a tick by a period or more: see who held it up."""
        if self.system.stalls is not None:
            self.system.stalls.delayed(self.fqn, 1.0 / timer.hz, seconds, lost)

    def on_holding(self, item: Item, seconds: float) -> None:
        """A handler keeps the node's other handlers waiting: tell once, with what it waits for and the remedy."""
        task = self.inbox.task
        lost = sum(timer.record.missed - timer.record.blocked for timer in self.timers)
        self.log.warning(
            f"handler holds the inbox for more than {seconds:g} s", handler=item.label, awaits=awaited_in(task) if task else "",
            ticks_lost=lost, remedy="declare it concurrent=n, make it an action, or self.offload() its work",
        )  # fmt: skip

    # -- the end ------------------------------------------------------------------------------------------------------------

    def release(self) -> None:
        """Give up, at once and without waiting, all that belongs to this incarnation only. Once: then it has `ended`."""
        self.ended = True
        self.mailbox.core = None
        self.stop_timers()
        for task in reversed(self.tasks):
            task.cancel()
        if self.sim is not None:
            self.sim.clock.close()
        self.mailbox.note(publisher.entry for publisher in self.publishers)
        self.mailbox.note(client.entry for client in self.clients.values())
        self.mailbox.note(server.entry for server in self.derived)
        for publisher in self.publishers:
            publisher.close()
        self.publishers.clear()
        for subscription in list(self.streams):
            subscription.close()
        for server in self.derived:
            server.fail_all(self.absent)
            server.entry.withdraw()
        self.derived.clear()
        self.mailbox.park(self.fqn, self.absent)
