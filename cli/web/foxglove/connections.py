"""The publishers, subscribers and servers of each name, as differences from one look to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.names.names import is_hidden

if TYPE_CHECKING:
    from actors.graph.snapshot import Snapshot

Users = dict[str, list[str]]


class Connections:
    """What one client knows of the graph. The first difference is the whole."""

    def __init__(self) -> None:
        self._published: Users = {}
        self._subscribed: Users = {}
        self._served: Users = {}

    def difference(self, snapshot: Snapshot) -> dict[str, Any] | None:
        """The message that brings a client up to date; None if it is."""
        published = {topic.name: _names(edge.node for edge in topic.publishers) for topic in snapshot.topics}
        subscribed = {topic.name: _names(edge.node for edge in topic.subscriptions) for topic in snapshot.topics}
        served = {
            service.name: [service.server]
            for service in snapshot.services
            if service.server and not is_hidden(service.name)
        }
        published, subscribed = ({name: ids for name, ids in users.items() if ids} for users in (published, subscribed))
        topics = (self._published.keys() | self._subscribed.keys()) - (published.keys() | subscribed.keys())
        update = {
            "op": "connectionGraphUpdate",
            "publishedTopics": _changed(self._published, published, "publisherIds"),
            "subscribedTopics": _changed(self._subscribed, subscribed, "subscriberIds"),
            "advertisedServices": _changed(self._served, served, "providerIds"),
            "removedTopics": sorted(topics),
            "removedServices": sorted(self._served.keys() - served.keys()),
        }
        first = not (self._published or self._subscribed or self._served)
        self._published, self._subscribed, self._served = published, subscribed, served
        return update if first or any(value for key, value in update.items() if key != "op") else None


def _names(nodes: Any) -> list[str]:
    return sorted({node for node in nodes if not is_hidden(node)})


def _changed(before: Users, after: Users, ids: str) -> list[dict[str, Any]]:
    gone: list[dict[str, Any]] = [{"name": name, ids: []} for name in before if name not in after]
    return [{"name": name, ids: users} for name, users in after.items() if before.get(name) != users] + gone
