"""Types of recorded topics that this process does not know: asked of the nodes that use them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.errors import InterfaceError
from actors.runtime.remote_types import action_parts, fetch

if TYPE_CHECKING:
    from actors.bag.offers import Offer
    from actors.graph.graph import Graph
    from actors.runtime.node import Node

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
    ends: list[Any] = [*offer.entry.publishers, *offer.entry.subscriptions]
    return [end for end in ends if end.type.__ros_type__ == offer.type_name]
