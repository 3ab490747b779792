"""`Endpoints`: the publishers, subscriptions, streams, servers, clients and goals of one life of a node.

Subscriptions with handlers and declared servers outlive a life: its `NodeRecord` keeps them, with what waits in them, for the next one. All
else is closed with the life.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping
from functools import partial
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NoReturn

from actors.actions.client import DIRECT, Goal
from actors.actions.driver import GoalHandlers
from actors.actions.server import ActionServer
from actors.checks import create
from actors.contracts.contracts import Service
from actors.errors import DeclarationError
from actors.interfaces.message import F, G, M, R, Req, Resp
from actors.parameters.declare import INTROSPECTION
from actors.parameters.descriptor import ParameterDescriptor
from actors.qos import (
    ACTION_FEEDBACK,
    ACTION_STATUS,
    DEFAULT,
    PARAMETER_EVENTS,
    ROSOUT,
    InvalidQoS,
    resolve_publisher,
    resolve_subscription,
)
from actors.qos.policies import QoS, changes
from actors.runtime.introspection import Introspection
from actors.services.client import Client, submit
from actors.services.server import InterceptedServer, Request, Server
from actors.time.deadlines import check_timeout
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.timed_publisher import publisher_for

if TYPE_CHECKING:
    from actors.actions.peers import ActionPeer
    from actors.contracts.content_filter import ContentFilter
    from actors.contracts.contracts import Action, ArrivalPolicy, Topic
    from actors.graph.graph import TopicEntry
    from actors.graph.servers import ServiceEntry
    from actors.interfaces.message import InterfaceClass, Message, ServiceType
    from actors.qos.policies import Overriding
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.interceptor import Interceptor
    from actors.services.peers import ServicePeer, Submit
    from actors.services.server import Handle, Take
    from actors.topics.handler import Handler
    from actors.topics.publisher import Publisher


NOTHING: Final[Mapping[Any, Any]] = MappingProxyType({})
"""What nodes have in the place of empty tables, each of which would take a hundredth of what a node takes."""

CLIENTS: Final = 256
"""The most service clients that a life keeps. When there are more, all are dropped; each is made again at its next call."""

_QOS: Final = attrgetter("qos")
_EVENT_QOS: Final = {
    "parameter_events": PARAMETER_EVENTS,
    "rosout": ROSOUT,
    "status": ACTION_STATUS,
    "feedback": ACTION_FEEDBACK,
}


class Endpoints:
    """What one life of a node has of topics, services and actions.

    It is used in the thread of the event loop, before the end of the life: `Node` sees to that.

    Invariants:

    - `publishers`, `streams`, `clients` and `standard` are those of this life only; `close` closes them.
    - Subscriptions with handlers and declared servers are in the record of the node; those whose `node` is this life are served by it.
    """

    __slots__ = ("_graph", "_introspection", "_life", "clients", "publishers", "publishing", "standard", "streams")

    def __init__(self, life: Incarnation) -> None:
        self._life = life
        self._graph = life.runtime.graph
        self._introspection: tuple[Introspection, ...] | None = None
        """Empty if the node lacks its parameters; None until the first service, client or action."""
        self.publishers: list[Publisher[Any]] = []
        """The open publishers, in the order in which they were made."""
        self.publishing = True
        """Whether the node's declared publishers deliver. For a lifecycle node that depends on its state."""
        self.streams: list[StreamSubscription[Any]] | None = None
        """The open streams, in the order in which they were made; None before the first."""
        self.clients: Mapping[Any, Client[Any, Any]] = NOTHING
        self.standard: tuple[Server, ...] = ()
        """The standard services of the node that have been opened, because they were asked for."""

    # -- topics -------------------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]:
        """A publisher, with the quality of service that the node's parameters override."""
        life = self._life
        entry = self._graph.topic(life.identity.topic(topic.name))
        if qos.overriding is not None:
            qos = self._overridden(entry.name, "publisher", qos, qos.overriding)
        offered = resolve_publisher(qos, map(_QOS, entry.readers))
        made = publisher_for(life, entry, topic.type, offered)
        self._add(made)
        if not self.publishing:
            made.suspend()
        return made

    def event_publisher(self, type: type[M], entry: TopicEntry) -> Publisher[M]:
        """The node's publisher on a standard topic, which is not declared in its class. It is made at its first use, and always delivers."""
        for publisher in self.publishers:
            if publisher.entry is entry and not publisher.gated:  # the node's code may have, and close, another one
                return publisher
        publisher = publisher_for(self._life, entry, type, _EVENT_QOS.get(entry.name.rpartition("/")[2], DEFAULT))
        publisher.gated = False
        self._add(publisher)
        return publisher

    def _publish_on(self, type: type[M], topic: str) -> Publisher[M]:
        return self.event_publisher(type, self._graph.topic(topic))

    def _add(self, publisher: Publisher[M]) -> None:
        """Let `publisher` join its topic. It is kept until it is closed."""
        self.publishers.append(publisher)
        publisher.owner = self
        publisher.entry.add_publisher(publisher)

    def publisher_closed(self, publisher: Publisher[M], /) -> None:
        """Forget a publisher that has been closed."""
        self.publishers.remove(publisher)
        self._life.record.note((publisher.entry,))

    def let_publish(self, allowed: bool) -> None:
        """Let the node's declared publishers deliver, or discard, what they are given. Those of standard topics always deliver."""
        self.publishing = allowed
        for publisher in self.publishers:
            if publisher.gated:
                if allowed:
                    publisher.resume()
                else:
                    publisher.suspend()

    def subscribe(
        self, topic: Topic[M], qos: QoS, filter: ContentFilter | None = None, patience: float = 0.0
    ) -> Stream[M]:
        """A stream, with the quality of service that the node's parameters override."""
        life = self._life
        entry = self._graph.topic(life.identity.topic(topic.name))
        if qos.overriding is not None:
            qos = self._overridden(entry.name, "subscription", qos, qos.overriding)
        requested = resolve_subscription(qos, map(_QOS, entry.writers))
        subscription = StreamSubscription(life, entry, topic.type, requested, self.stream_closed, filter, patience)
        self.join(subscription)
        return create(Stream, subscription, life.runtime.loop)

    def join(self, subscription: StreamSubscription[M]) -> None:
        """Let the subscription of a stream, which calls `stream_closed` at its end, join its topic."""
        if self.streams is None:
            self.streams = []
        self.streams.append(subscription)
        subscription.entry.add_subscription(subscription)

    def stream_closed(self, subscription: StreamSubscription[M]) -> None:
        """Forget a stream that has been closed."""
        assert self.streams is not None
        self.streams.remove(subscription)
        self._life.record.note((subscription.entry,))

    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]:
        """The subscription of this life's first handler of `topic`. Raises `DeclarationError` without one."""
        life = self._life
        name = life.identity.topic(topic.name)
        for each in life.record.subscriptions:
            if each.node is life and each.entry.name == name:
                return each
        raise DeclarationError(f"{life.fqn} has no handler of {name}: declare one with @{topic!r}.on()")

    def handle(
        self,
        topic: Topic[M],
        qos: QoS,
        handler: Handler[M],
        label: str,
        concurrent: int = 0,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> None:
        """Subscribe `handler` to `topic`. A subscription of the last life is taken over, with the messages that wait in it."""
        life = self._life
        if life.runtime.interceptors:
            handler = life.invoking(label, handler)
        entry = self._graph.topic(life.identity.topic(topic.name))
        if qos.overriding is not None:
            qos = self._overridden(entry.name, "subscription", qos, qos.overriding)
        if life.incarnation > 1:
            subscription = self._left_over(entry, topic.type, label, concurrent, filter is not None)
            if subscription is not None:
                subscription.take_over(life, handler, filter)
                return
        qos = resolve_subscription(qos, map(_QOS, entry.writers))
        subscription = (ConcurrentSubscription if concurrent else HandlerSubscription)(
            life, entry, topic.type, qos, life.inbox, label, handler, concurrent, patience, filter
        )
        if isinstance(subscription, ConcurrentSubscription) and life.serving:
            subscription.start(life.create_task)
        life.record.subscriptions = (*life.record.subscriptions, subscription)
        entry.add_subscription(subscription)

    def _left_over(
        self, entry: TopicEntry, type: type[M], label: str, concurrent: int, filtered: bool
    ) -> HandlerSubscription[M] | None:
        """The first subscription of the last life with the same handler, topic and type that has not been taken over; else None."""
        life = self._life
        for each in life.record.subscriptions:
            same = each.node is not life and each.label == label and each.entry is entry and each.type is type
            if same and (each.concurrent, each.filter is not None) == (concurrent, filtered):
                return each
        return None

    def _overridden(self, topic: str, kind: str, qos: QoS, overriding: Overriding) -> QoS:
        """The profile of a new endpoint, a ``publisher`` or ``subscription`` of `topic` (its full name), as the node's parameters say.

        The parameters are declared, unless an earlier endpoint has done that. Raises `InvalidQoS` for values that are none, or that the
        endpoint refuses.
        """
        life, values = self._life, dict[str, object]()
        store = life.parameters
        for policy, (name, default) in overriding.parameters(topic, kind, qos).items():
            if not store.has(name):
                description = f"{policy} for {kind} `{topic}`{f' with id `{overriding.id}`' if overriding.id else ''}"
                store.declare(name, default, ParameterDescriptor(description=description, read_only=True))
            if (value := store.value(name)) != default:
                values[policy] = value
        try:
            found = qos.replace(**changes(values))
        except InvalidQoS as error:
            raise InvalidQoS(f"{life.fqn}: the parameters for its {kind} of {topic}: {error}") from None
        reason = None if overriding.validate is None else overriding.validate(found)
        if reason is not None:
            raise InvalidQoS(f"{life.fqn}: its {kind} of {topic} cannot be {found!r}: {reason}")
        return found

    # -- services and actions -----------------------------------------------------------------------------------------------

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        """A new client of `service`, which is kept in `clients`; there must be none of it yet."""
        life = self._life
        if len(self.clients) >= CLIENTS:  # the node makes contracts while it runs: bound what they cost
            life.record.note(one.entry for one in self.clients.values())
            self.clients = NOTHING
        entry = self._graph.service(life.identity.service(service.name))
        made = Client(life, entry, service)
        self.clients = {**self.clients, service: made}
        if interceptors := self._interceptors:
            sending: Submit = submit
            for each in reversed(interceptors):
                sending = each.calling(made, sending)
            made.submit = None if sending is submit else sending
        entry.clients[life.fqn] = entry.clients.get(life.fqn, 0)
        return made

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        """A goal that this life may start."""
        life = self._life
        entry = self._graph.action(life.identity.service(action.name))
        entry.clients[life.fqn] = entry.clients.get(life.fqn, 0) + 1
        life.record.note((entry,))
        ways = DIRECT
        for each in reversed(self._interceptors):
            ways = each.sending_goals(life, entry, ways)
        return create(Goal, life, entry, action, message, timeout, ways)

    async def wait_for(
        self, contracts: Iterable[Service[Any, Any] | Action[Any, Any, Any]], timeout: float | None
    ) -> None:
        """Wait until each of these is served, `timeout` seconds at most in all. Raises what `Node.wait_for` raises."""
        life, graph = self._life, self._graph
        if timeout is not None:
            check_timeout(f"{life.fqn}.wait_for", timeout)
        end = None if timeout is None else life.runtime.loop.time() + timeout
        for contract in contracts:
            name = life.identity.service(contract.name)
            entry = graph.service(name) if isinstance(contract, Service) else graph.action(name)
            try:
                async with asyncio.timeout_at(end):
                    await entry.available()
            except TimeoutError:
                assert timeout is not None
                raise entry.unavailable(timeout) from None

    def serve(
        self,
        service: Service[Req, Resp],
        handler: Callable[[Req], Coroutine[object, None, Resp]],
        label: str,
        concurrent: int = 0,
    ) -> None:
        """Let `handler` answer the requests of `service`. Raises `DeclarationError` when another node serves it."""
        life = self._life
        entry = self._graph.service(life.identity.service(service.name))
        if entry.local is not None:
            self._refuse_second(entry.name, entry.local, "service", service.type)
        if life.runtime.interceptors:
            handler = life.invoking(label, handler)
        server = self.server(entry, service.type, handler, label, concurrent, declared=True)
        life.record.services = {**life.record.services, entry.name: server}
        entry.open(server)

    def server(
        self,
        entry: ServiceEntry,
        type: type[ServiceType[Req, Resp]],
        handler: Callable[[Any], Awaitable[Message]],
        label: str,
        concurrent: int,
        *,
        declared: bool,
    ) -> Server:
        """A server that is not open yet, behind the interceptors; only they hear of the handling of what is not `declared`."""
        interceptors = self._interceptors
        if interceptors:
            interceptors = tuple(each for each in interceptors if each.of_servers)
        if not interceptors:
            return Server(self._life, entry, type, handler, label, concurrent)
        server = InterceptedServer(self._life, entry, type, handler, label, concurrent)
        taking: Take = partial(Server.submit, server)
        handling: Handle = Request.handle
        for each in interceptors:
            taking = each.taking(server, taking)
            handling = each.handling(server, handling) if declared else handling
        server.taking, server.handling = taking, handling
        return server

    def serve_action(
        self, action: Action[G, R, F], handlers: GoalHandlers, arrivals: ArrivalPolicy, result_timeout: float
    ) -> None:
        """Let `handlers` serve `action`. Raises `DeclarationError` when another node serves it."""
        life, graph = self._life, self._graph
        entry = graph.action(life.identity.service(action.name))
        server = ActionServer(life, entry, action, handlers, arrivals, result_timeout)
        if entry.local is not None:
            self._refuse_second(entry.name, entry.local, "action", server.type)
        for each in self._interceptors:
            server.ways = each.serving_goals(server, server.ways)
        life.record.actions = {**life.record.actions, entry.name: server}
        entry.open(server)
        for part in ("status", "feedback"):  # a subscription that outlives the last life receives from this one
            topic = graph.topics.get(f"{entry.name}/_action/{part}")
            if topic is not None and topic.subscriptions:
                graph.open_standard_topic(topic)

    def _refuse_second(
        self, name: str, first: ServicePeer | ActionPeer, kind: str, offered: InterfaceClass
    ) -> NoReturn:
        served_type, offered_type = first.type.__ros_type__, offered.__ros_type__
        types = f" as {served_type}, not as {offered_type}" if served_type != offered_type else ""
        raise DeclarationError(
            f"{self._life.fqn} would be the second server of {kind} {name}, which {first.host} serves already{types}: "
            "give one of them another name or namespace"
        )

    # -- interceptors -------------------------------------------------------------------------------------------------------

    @property
    def _interceptors(self) -> tuple[Interceptor, ...]:
        """Those of this life; the first is the nearest to the node."""
        life, own = self._life, self._introspection
        if own is None:
            overrides = life.identity.overrides
            has = life.declarations.introspected or (overrides and not overrides.keys().isdisjoint(INTROSPECTION))
            own = self._introspection = (Introspection(life, self._level, self._publish_on),) if has else ()
        return (*own, *life.runtime.interceptors) if own else life.runtime.interceptors

    def introspect(self) -> None:
        """Let all services, clients and actions of this life do as the parameters of introspection say now."""
        for each in self._introspection or ():
            each.update()

    def _level(self, parameter: str) -> str:
        """`off`, `metadata` or `contents`."""
        life = self._life
        if parameter not in life.identity.overrides and parameter not in life.declarations.table.values:
            return "off"  # without making the store of the parameters
        level = str(life.parameters.value(parameter))
        return "off" if level == "disabled" else level

    # -- from the start of the life to its end ------------------------------------------------------------------------------

    def open_declared(self) -> None:
        """Open all endpoints that the node's class declares. Messages are queued from now on, and handled once the node has started."""
        life = self._life
        node, declarations = life.node, life.declarations
        for topic in declarations.topics:
            handler, label = getattr(node, topic.attribute), declarations.labels[topic.attribute]
            self.handle(topic.topic, topic.qos, handler, label, topic.concurrent, topic.patience, topic.filter)
        for service in declarations.services:
            handler, label = getattr(node, service.attribute), declarations.labels[service.attribute]
            self.serve(service.service, handler, label, service.concurrent)
        for action in declarations.actions:
            hooks = {
                hook.verb: getattr(node, hook.attribute) for hook in declarations.hooks if hook.action is action.action
            }
            body, label = getattr(node, action.attribute), declarations.labels[action.attribute]
            self.serve_action(action.action, GoalHandlers(label, body, **hooks), action.arrivals, action.result_timeout)

    def open_published(self) -> None:
        """Make the publishers and streams that the node's class declares, its attributes."""
        node, declarations = self._life.node, self._life.declarations
        for published in declarations.publishers:
            setattr(node, published.attribute, self.publisher(published.topic, published.qos))
        for stream in declarations.streams:
            setattr(node, stream.attribute, self.subscribe(stream.topic, stream.qos, stream.filter, stream.patience))

    def serve_concurrently(self) -> None:
        """Let concurrent handlers begin, with the messages and requests that came during the start phase."""
        life = self._life
        for subscription in life.record.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.start(life.create_task)
        for server in life.record.services.values():
            server.begin()

    def retire(self, error: Callable[[], Exception]) -> None:
        """Close all declared endpoints of a node that goes on for its standard services only. What it publishes from now on is discarded.

        Unanswered requests fail with `error()`, goals are aborted with its text and their bodies interrupted, and messages that wait are lost.
        """
        life = self._life
        record = life.record
        for publisher in [one for one in self.publishers if one.gated]:
            publisher.close()
            publisher.suspend()
        for stream in list(self.streams or ()):
            stream.close()
        for subscription in record.subscriptions:
            subscription.close()
        record.subscriptions = ()
        record.inbox.discard(lambda item: isinstance(item, HandlerSubscription))
        for action in record.actions.values():
            action.stop(str(error()))
        servers: list[Server | ActionServer] = [*record.services.values(), *record.actions.values()]
        for server in servers:
            server.fail_all(error)
            server.entry.close(life.fqn)
        told = tuple(f"{name}/_action/" for name in record.actions)
        for publisher in [one for one in self.publishers if one.entry.name.startswith(told)]:
            publisher.close()
        record.services = record.actions = NOTHING

    def close(self) -> None:
        """Close the endpoints that belong to this life only: publishers, streams, clients and standard services.

        Subscriptions and declared servers stay in the record for the next life.
        """
        life = self._life
        record = life.record
        for publisher in list(self.publishers):
            publisher.close()
        if self.clients:
            record.note(client.entry for client in self.clients.values())
        for subscription in list(self.streams or ()):
            subscription.close()
        if self.standard:
            record.note(server.entry for server in self.standard)
            for server in self.standard:
                server.fail_all(life.absent)
                server.entry.withdraw()
            self.standard = ()
