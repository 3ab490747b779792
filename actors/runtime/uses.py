"""What one incarnation uses of others: publishers, streams, clients and goals, each made when the node asks for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.actions.client import Goal
from actors.errors import DeclarationError
from actors.qos import resolve_publisher, resolve_subscription
from actors.runtime import introspection
from actors.runtime.endpoints import add_publisher
from actors.runtime.qos_overrides import overridden
from actors.services.client import Client
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.timed_publisher import publisher_for

if TYPE_CHECKING:
    from actors.contracts.contracts import Action, Service, Topic
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.runtime.incarnation import Incarnation
    from actors.topics.content_filter import ContentFilter
    from actors.topics.handler import HandlerSubscription
    from actors.topics.publisher import Publisher

__all__ = ["client", "goal", "publisher", "subscribe", "subscription"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")

CLIENTS: Final = 256
"""The most service clients that an incarnation keeps. When there are more, all are dropped; each is made again at its next call."""


def publisher(life: Incarnation, topic: Topic[M], qos: QoS) -> Publisher[M]:
    """A publisher of this incarnation, with the quality of service that its parameters override."""
    life.check_use()
    entry = life.runtime.graph.topic(life.identity.topic(topic.name))
    qos = overridden(life, entry.name, "publisher", qos)
    offered = resolve_publisher(qos, [one.qos for one in entry.subscriptions])
    made = publisher_for(life, entry, topic.type, offered)
    add_publisher(life, made)
    if not life.publishing:
        made.suspend()
    return made


def subscribe(life: Incarnation, topic: Topic[M], qos: QoS, filter: ContentFilter | None) -> Stream[M]:
    """A stream of this incarnation, with the quality of service that its parameters override."""
    life.check_use()
    if filter is not None:
        filter.check(topic.type)
    entry = life.runtime.graph.topic(life.identity.topic(topic.name))
    qos = overridden(life, entry.name, "subscription", qos)
    requested = resolve_subscription(qos, [one.qos for one in entry.publishers])

    def closed(subscription: StreamSubscription[Any]) -> None:
        life.streams.remove(subscription)
        life.record.note((subscription.entry,))

    subscription = StreamSubscription(life, entry, topic.type, requested, closed, filter)
    life.streams.append(subscription)
    entry.add_subscription(subscription)
    return Stream(subscription, life.runtime.loop)


def subscription(life: Incarnation, topic: Topic[M]) -> HandlerSubscription[M]:
    """The subscription of this incarnation's first handler of `topic`. Raises `DeclarationError` without one."""
    name = life.identity.topic(topic.name)
    for each in life.record.subscriptions:
        if each.node is life and each.entry.name == name:
            return each
    raise DeclarationError(f"{life.fqn} has no handler of {name}: declare one with @{topic!r}.on()")


def client(life: Incarnation, service: Service[Req, Resp]) -> Client[Req, Resp]:
    """A new client of `service`, which is kept in the incarnation's `clients`; there must be none of it yet."""
    if len(life.clients) >= CLIENTS:  # the node makes contracts while it runs: bound what they cost
        life.record.note(one.entry for one in life.clients.values())
        life.clients.clear()
    entry = life.runtime.graph.service(life.identity.service(service.name))
    if life.inbox.border is not None:
        life.inbox.border.uses(entry)
    made = life.clients[service] = Client(life, entry, service)
    introspection.watch_client(life, made)
    entry.clients[life.fqn] = entry.clients.get(life.fqn, 0)
    return made


def goal(life: Incarnation, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
    """A goal that this incarnation may start."""
    entry = life.runtime.graph.action(life.identity.service(action.name))
    entry.clients[life.fqn] = entry.clients.get(life.fqn, 0) + 1
    life.record.note((entry,))
    if life.inbox.border is not None:
        life.inbox.border.uses(entry)
    return Goal(life, entry, action, message, timeout)
