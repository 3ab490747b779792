"""The endpoints of one incarnation: opening what its class declares, taking over subscriptions of the last life, closing all."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from actors.actions.driver import GoalHandlers
from actors.actions.server import ActionServer
from actors.errors import DeclarationError
from actors.qos import (
    ACTION_FEEDBACK,
    ACTION_STATUS,
    DEFAULT,
    PARAMETER_EVENTS,
    ROSOUT,
    resolve_subscription,
)
from actors.qos.policies import QoS
from actors.runtime import introspection
from actors.runtime.qos_overrides import overridden
from actors.services.server import Server
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription
from actors.topics.timed_publisher import publisher_for

if TYPE_CHECKING:
    from actors.actions.peers import ActionPeer
    from actors.contracts.contracts import Service, Topic
    from actors.graph.graph import TopicEntry
    from actors.graph.servers import ActionEntry
    from actors.interfaces.message import Message
    from actors.runtime.incarnation import Incarnation
    from actors.services.peers import ServicePeer
    from actors.topics.handler import Handler
    from actors.topics.publisher import Publisher

__all__ = [
    "add_publisher",
    "close_all",
    "event_publisher",
    "handle",
    "open_declared_endpoints",
    "retire",
    "serve",
    "serve_concurrently",
]

M = TypeVar("M", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")

_EVENT_QOS: Final = {
    "parameter_events": PARAMETER_EVENTS,
    "rosout": ROSOUT,
    "status": ACTION_STATUS,
    "feedback": ACTION_FEEDBACK,
}


def open_declared_endpoints(life: Incarnation) -> None:
    """Open all endpoints that the node's class declares. Messages are queued from now on, and handled once the node has started.

    A setting that nobody has made costs a start nothing: without overrides and observers the parameters are opened at their first use.
    """
    node, declarations = life.node, life.declarations
    if declarations.overridable:
        _open_parameters(life)
    for published in declarations.publishers:
        setattr(node, published.attribute, life.publisher(published.topic, published.qos))
    for stream in declarations.streams:
        setattr(node, stream.attribute, life.subscribe(stream.topic, stream.qos))
    if not declarations.overridable:
        _open_parameters(life)
    if "use_sim_time" in life.identity.overrides and life.parameters.value("use_sim_time"):
        life.ros_time().use(True)
    labels = declarations.labels
    for topic in declarations.topics:
        handler, label = getattr(node, topic.attribute), labels[topic.attribute]
        handle(life, topic.topic, topic.qos, handler, label, topic.concurrent, topic.patience)
    for service in declarations.services:
        serve(life, service.service, getattr(node, service.attribute), labels[service.attribute], service.concurrent)
    for action in declarations.actions:
        entry = life.runtime.graph.action(life.identity.service(action.action.name))
        hooks = {
            hook.verb: getattr(node, hook.attribute) for hook in declarations.hooks if hook.action is action.action
        }
        handlers = GoalHandlers(labels[action.attribute], getattr(node, action.attribute), **hooks)
        _serve_action(
            life, entry, ActionServer(life, entry, action.action, handlers, action.arrivals, action.result_timeout)
        )


def _open_parameters(life: Incarnation) -> None:
    """Open the parameters if their overrides have to be checked, or observers to be told."""
    if life.declarations.parameters and (life.identity.overrides or life.runtime.observers.parameters):
        life.open_parameters(announce=True)


def handle(
    life: Incarnation,
    topic: Topic[M],
    qos: QoS,
    handler: Handler[M],
    label: str,
    concurrent: int = 0,
    patience: float = 0.0,
) -> None:
    """Subscribe `handler` to `topic`. A subscription of the last incarnation is taken over, with the messages that wait in it."""
    life.check_use()
    entry = life.runtime.graph.topic(life.identity.topic(topic.name))
    qos = overridden(life, entry.name, "subscription", qos)
    subscription = _left_over(life, entry, topic.type, label, concurrent)
    if subscription is not None:
        subscription.take_over(life, handler)
        return
    qos = resolve_subscription(qos, [one.qos for one in entry.publishers])
    if concurrent:
        subscription = ConcurrentSubscription(
            life, entry, topic.type, qos, life.inbox, label, handler, concurrent, patience
        )
    else:
        subscription = HandlerSubscription(life, entry, topic.type, qos, life.inbox, label, handler, patience)
    life.record.subscriptions.append(subscription)
    entry.add_subscription(subscription)


def _left_over(
    life: Incarnation, entry: TopicEntry, type: type[M], label: str, concurrent: int
) -> HandlerSubscription[M] | None:
    """The first subscription of the last incarnation with the same handler, topic and type that has not been taken over; else None."""
    for each in life.record.subscriptions:
        same = each.node is not life and each.label == label and each.entry is entry and each.type is type
        if same and concurrent == (each.concurrent if isinstance(each, ConcurrentSubscription) else 0):
            return each
    return None


def serve(
    life: Incarnation,
    service: Service[Req, Resp],
    handler: Callable[[Req], Coroutine[Any, Any, Resp]],
    label: str,
    concurrent: int = 0,
) -> None:
    """Let `handler` answer the requests of `service`. Raises `DeclarationError` when another node serves it."""
    life.check_use()
    entry = life.runtime.graph.service(life.identity.service(service.name))
    if entry.local is not None:
        _refuse_second(life, entry.name, entry.local, "service", service.type)
    server = Server(life, entry, service.type, handler, label, concurrent)
    introspection.watch_server(life, server)
    life.record.services[entry.name] = server
    entry.open(server)


def _serve_action(life: Incarnation, entry: ActionEntry, server: ActionServer) -> None:
    if entry.local is not None:
        _refuse_second(life, entry.name, entry.local, "action", server.type)
    introspection.watch_action(life, server)
    life.record.actions[entry.name] = server
    entry.open(server)
    graph = life.runtime.graph
    for part in ("status", "feedback"):  # a subscription that outlives the last incarnation receives from this one
        topic = graph.topics.get(f"{entry.name}/_action/{part}")
        if topic is not None and topic.subscriptions:
            graph.open_standard_topic(topic)


def _refuse_second(
    life: Incarnation, name: str, first: ServicePeer | ActionPeer, kind: str, offered: type[Any]
) -> NoReturn:
    served_type, offered_type = first.type.__ros_type__, offered.__ros_type__
    types = f" as {served_type}, not as {offered_type}" if served_type != offered_type else ""
    raise DeclarationError(
        f"{life.fqn} would be the second server of {kind} {name}, which {first.host} serves already{types}: "
        "give one of them another name or namespace"
    )


def serve_concurrently(life: Incarnation) -> None:
    """Let concurrent handlers begin, with the messages and requests that came during the start phase."""
    life.serving = True
    for subscription in life.record.subscriptions:
        if isinstance(subscription, ConcurrentSubscription):
            subscription.start(life.spawn)
    for server in life.record.services.values():
        server.begin()


def event_publisher(life: Incarnation, type: type[M], entry: TopicEntry) -> Publisher[M]:
    """The node's publisher on a standard topic, which is not declared in its class. It is made at its first use, and always delivers."""
    for publisher in life.publishers:
        if publisher.entry is entry and not publisher.gated:  # the node's code may have, and close, another one
            return publisher
    publisher = publisher_for(life, entry, type, _EVENT_QOS.get(entry.name.rpartition("/")[2], DEFAULT))
    publisher.gated = False
    add_publisher(life, publisher)
    return publisher


def add_publisher(life: Incarnation, publisher: Publisher[Any]) -> None:
    """Let `publisher` join its topic. The incarnation keeps it until it is closed."""

    def closed(publisher: Publisher[Any]) -> None:
        del life.publishers[publisher]
        life.record.note((publisher.entry,))

    life.publishers[publisher] = None
    publisher.on_close = closed
    publisher.entry.add_publisher(publisher)


def retire(life: Incarnation, error: Callable[[], Exception]) -> None:
    """Close all declared endpoints of a node that goes on for its standard services only. What it publishes from now on is discarded.

    Unanswered requests fail with `error()`, goals are aborted with its text and their bodies interrupted, and messages that wait are lost.
    """
    record = life.record
    for publisher in [one for one in life.publishers if one.gated]:
        publisher.close()
        publisher.suspend()
    for stream in list(life.streams):
        stream.close()
    for subscription in record.subscriptions:
        subscription.close()
    record.subscriptions.clear()
    record.inbox.discard(lambda item: isinstance(item, HandlerSubscription))
    for action in record.actions.values():
        action.stop(str(error()))
    servers: list[Server | ActionServer] = [*record.services.values(), *record.actions.values()]
    for server in servers:
        server.fail_all(error)
        server.entry.close(life.fqn)
    told = tuple(f"{name}/_action/" for name in record.actions)
    for publisher in [one for one in life.publishers if one.entry.name.startswith(told)]:
        publisher.close()
    record.services.clear()
    record.actions.clear()


def close_all(life: Incarnation) -> None:
    """Close the endpoints that belong to this incarnation only: publishers, streams, clients and standard services.

    Subscriptions and declared servers stay in the record for the next incarnation.
    """
    record = life.record
    for publisher in list(life.publishers):
        publisher.close()
    if life.clients:
        record.note(client.entry for client in life.clients.values())
    for subscription in list(life.streams):
        subscription.close()
    if life.standard_services:
        record.note(server.entry for server in life.standard_services)
        for server in life.standard_services:
            server.fail_all(life.absent)
            server.entry.withdraw()
        life.standard_services.clear()
