"""What there is to record: the topics of the graph, also those that are opened only when somebody asks for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from actors.graph.graph import Graph, TopicEntry
from actors.interfaces import derived
from actors.interfaces.errors import InterfaceError
from actors.interfaces.foreign import ForeignType
from actors.interfaces.lookup import find
from actors.interfaces.message import Message
from actors.qos.policies import QoS
from actors.runtime.node import Node
from actors.runtime.remote_types import action_parts, fetch
from actors.runtime.standard import PARAMETER_EVENTS, ROSOUT
from actors.topics.peers import Participant, PublisherPeer, SubscriptionPeer

STANDARD = {ROSOUT: "rcl_interfaces/msg/Log", PARAMETER_EVENTS: "rcl_interfaces/msg/ParameterEvent"}
"""The topics of every system of this process, which have no publisher before the first subscription."""


class Offer(NamedTuple):
    """One topic of one type."""

    entry: TopicEntry
    type_name: str
    type: type[Message] | None
    """None if this process does not know the type."""

    offered: tuple[QoS, ...]
    """What each publisher offers; none if the topic is opened by a subscription."""

    used: bool
    """Whether a node but the one that asks subscribes to it."""


def offers(graph: Graph, asking: Participant, *, unpublished: bool) -> Iterator[Offer]:
    """Every topic with a publisher but the asking node, each type of it by itself; with `unpublished` also those that have none."""
    names = dict(STANDARD)
    for action in list(graph.actions.values()):
        if action.local is not None:
            names[f"{action.name}/_action/status"] = "action_msgs/msg/GoalStatusArray"
            names[f"{action.name}/_action/feedback"] = derived.feedback_message(action.local.type).__ros_type__
    for name, entry in list(graph.topics.items()):
        ends: list[PublisherPeer | SubscriptionPeer] = [end for end in entry.publishers if end.node is not asking]
        if unpublished:
            ends += [end for end in entry.subscriptions if end.node is not asking]
        for type_name in {end.type.__ros_type__: None for end in ends}:
            names.pop(name, None)
            yield _offer(entry, type_name, asking)
    for name, type_name in names.items():
        yield _offer(graph.topic(name), type_name, asking)


def _offer(entry: TopicEntry, type_name: str, asking: Participant) -> Offer:
    publishers = [one for one in entry.publishers if one.type.__ros_type__ == type_name and one.node is not asking]
    used = any(subscription.node is not asking for subscription in entry.subscriptions)
    kind = next((one.type for one in publishers if one.here), None) or _known(type_name)
    return Offer(entry, type_name, kind, tuple(one.qos for one in publishers), used)


def known_type(kind: Any) -> type[Message] | None:
    """The type of an endpoint of this process or another one; None if this process does not know it."""
    return _known(kind.__ros_type__) if isinstance(kind, ForeignType) else kind


def _known(type_name: str) -> type[Message] | None:
    try:
        found = find(type_name)
    except InterfaceError:
        return None
    return found if found is not None and issubclass(found, Message) else None


_EVENT, _ACTION = "_Event", "/_action/"


class RemoteTypes:
    """The types that are missing here, and the nodes that have been asked for them: each node once for each type."""

    def __init__(self) -> None:
        self._asked: set[tuple[str, str]] = set()

    def owners(self, offer: Offer) -> list[str]:
        """The nodes that use this type on this topic and have not been asked yet; from now on they have been."""
        nodes = dict.fromkeys(end.node.fqn for end in _ends(offer))
        new = [node for node in nodes if (node, offer.type_name) not in self._asked]
        self._asked.update((node, offer.type_name) for node in new)
        return new

    async def fetch(self, node: Node, graph: Graph, offer: Offer, owners: list[str]) -> bool:
        """Ask for the type of an offer, which may be one that belongs to a service or an action. Returns whether it is known now."""
        name, parts = _wanted(graph, offer)
        try:
            return await fetch(node, name, parts, owners)
        except InterfaceError:
            return False  # what it describes is no type


def _wanted(graph: Graph, offer: Offer) -> tuple[str, list[tuple[str, str]]]:
    """The type to define, which is that of the action or service for what belongs to one, and the types to ask for with their hashes."""
    topic, type_name = offer.entry.name, offer.type_name
    package, kind, leaf = type_name.split("/")
    if kind == "action":
        action = f"{package}/{kind}/{leaf.partition('_')[0]}"
        return action, action_parts(graph, topic.partition(_ACTION)[0], action)
    type_hash = next(end.type.type_hash for end in _ends(offer))
    return type_name.removesuffix(_EVENT) if kind == "srv" else type_name, [(type_name, type_hash)]


def _ends(offer: Offer) -> list[Any]:
    """The publishers and subscriptions of an offer, which are all of other processes if its type is not known here."""
    ends: list[PublisherPeer | SubscriptionPeer] = [*offer.entry.publishers, *offer.entry.subscriptions]
    return [end for end in ends if end.type.__ros_type__ == offer.type_name]
