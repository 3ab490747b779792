"""rosapi's questions about nodes, topics, services and actions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from actors.names.names import is_hidden
from cli.web.clients.names import absolute, interface
from cli.web.graph.parameters import node_names

if TYPE_CHECKING:
    from cli.web.hub import Hub


class GraphAnswers:
    """The answers from the graph as it is when it is asked for. Hidden names are left out of lists."""

    def __init__(self, hub: Hub) -> None:
        self._catalog = hub.catalog
        self._system = hub.system
        self._graph = hub.system.graph

    async def topics(self) -> dict[str, Any]:
        await self._catalog.update()
        shown = sorted({(one.topic, one.type.__ros_type__) for one in self._catalog.channels.values()})
        shown = [pair for pair in shown if not is_hidden(pair[0])]
        return {"topics": [name for name, _ in shown], "types": [kind for _, kind in shown]}

    async def topic_type(self, topic: str) -> dict[str, Any]:
        await self._catalog.update()
        wanted = absolute(topic)
        found = (one.type.__ros_type__ for one in self._catalog.channels.values() if one.topic == wanted)
        return {"type": next(found, "")}

    async def topics_for_type(self, type: str) -> dict[str, Any]:
        listed, wanted = await self.topics(), interface(type, "msg")
        pairs = zip(listed["topics"], listed["types"], strict=True)
        return {"topics": [name for name, kind in pairs if kind == wanted]}

    def services(self) -> dict[str, Any]:
        return {"services": [name for name, _ in self._services()]}

    def service_type(self, service: str) -> dict[str, Any]:
        return {"type": dict(self._services()).get(absolute(service), "")}

    def services_for_type(self, type: str) -> dict[str, Any]:
        wanted = interface(type, "srv")
        return {"services": [name for name, kind in self._services() if kind == wanted]}

    def service_node(self, service: str) -> dict[str, Any]:
        return {"node": next(iter(self._providers(absolute(service))), "")}

    def service_providers(self, service: str) -> dict[str, Any]:
        return {"providers": self._providers(absolute(service))}

    def action_servers(self) -> dict[str, Any]:
        return {"action_servers": sorted(name for name, one in self._graph.actions.items() if one.server is not None)}

    def action_type(self, action: str) -> dict[str, Any]:
        entry = self._graph.actions.get(absolute(action))
        return {"type": entry.server.type.__ros_type__ if entry is not None and entry.server is not None else ""}

    def nodes(self) -> dict[str, Any]:
        return {"nodes": node_names(self._system)}

    def node_details(self, node: str) -> dict[str, Any]:
        name = absolute(node)
        topics = self._graph.topics.values()
        publishing = [one.name for one in topics if any(end.node.fqn == name for end in one.publishers)]
        subscribing = [one.name for one in topics if any(end.node.fqn == name for end in one.subscriptions)]
        served = [
            one.name for one in self._graph.services.values() if one.server is not None and one.server.host == name
        ]
        served += [service for service, _ in self._services() if service.startswith(f"{name}/")]
        return {"publishing": _shown(publishing), "subscribing": _shown(subscribing), "services": _shown(served)}

    def publishers(self, topic: str) -> dict[str, Any]:
        entry = self._graph.topics.get(absolute(topic))
        return {"publishers": _shown(end.node.fqn for end in entry.publishers) if entry is not None else []}

    def subscribers(self, topic: str) -> dict[str, Any]:
        entry = self._graph.topics.get(absolute(topic))
        return {"subscribers": _shown(end.node.fqn for end in entry.subscriptions) if entry is not None else []}

    def _services(self) -> list[tuple[str, str]]:
        return sorted(self._catalog.all_services())

    def _providers(self, service: str) -> list[str]:
        entry = self._graph.services.get(service)
        if entry is not None and entry.server is not None:
            return sorted({one.host for one in (entry.local, *entry.remotes) if one is not None})
        listed = dict(self._services())
        owner = service.rpartition("/")[0]
        return [owner] if service in listed and owner in node_names(self._system) else []


def _shown(names: Iterable[str]) -> list[str]:
    return sorted({name for name in names if not is_hidden(name)})
