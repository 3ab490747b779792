"""rosapi: what rosbridge clients ask about the graph, answered by the server itself under /rosapi/."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Any

from actors.suggest import did_you_mean
from cli.web.clients.errors import Refused
from cli.web.clients.fields import by_name
from cli.web.rosbridge.rosapi.definitions import Definitions
from cli.web.rosbridge.rosapi.graph import GraphAnswers
from cli.web.rosbridge.rosapi.parameters import ParameterAnswers

if TYPE_CHECKING:
    from cli.web.hub import Hub

Answer = Callable[..., "Awaitable[dict[str, Any]] | dict[str, Any]"]


class Rosapi:
    """The services of rosapi, for one graph. Arguments are an object, or a list in the order of the fields."""

    def __init__(self, hub: Hub) -> None:
        self._system = hub.system
        graph, types, parameters = GraphAnswers(hub), Definitions(hub), ParameterAnswers(hub)
        self._answers: Mapping[str, tuple[Answer, tuple[str, ...]]] = {
            "topics": (graph.topics, ()),
            "topic_type": (graph.topic_type, ("topic",)),
            "topics_for_type": (graph.topics_for_type, ("type",)),
            "topics_and_raw_types": (types.topics_and_raw_types, ()),
            "interfaces": (types.interfaces, ()),
            "services": (graph.services, ()),
            "service_type": (graph.service_type, ("service",)),
            "services_for_type": (graph.services_for_type, ("type",)),
            "service_node": (graph.service_node, ("service",)),
            "service_providers": (graph.service_providers, ("service",)),
            "service_request_details": (types.service_request, ("type",)),
            "service_response_details": (types.service_response, ("type",)),
            "message_details": (types.message, ("type",)),
            "action_goal_details": (types.action_goal, ("type",)),
            "action_result_details": (types.action_result, ("type",)),
            "action_feedback_details": (types.action_feedback, ("type",)),
            "action_servers": (graph.action_servers, ()),
            "action_type": (graph.action_type, ("action",)),
            "nodes": (graph.nodes, ()),
            "node_details": (graph.node_details, ("node",)),
            "publishers": (graph.publishers, ("topic",)),
            "subscribers": (graph.subscribers, ("topic",)),
            "get_param_names": (parameters.names, ()),
            "get_param": (parameters.get, ("name", "default_value")),
            "has_param": (parameters.has, ("name",)),
            "set_param": (parameters.put, ("name", "value")),
            "delete_param": (parameters.delete, ("name",)),
            "get_time": (self._time, ()),
            "get_ros_version": (self._version, ()),
        }

    async def answer(self, name: str, arguments: Any) -> dict[str, Any]:
        """The response of `/rosapi/name`. Raises `Refused`."""
        found = self._answers.get(name)
        if found is None:
            raise Refused(f"there is no service /rosapi/{name:.80}{did_you_mean(name, list(self._answers))}")
        answer, fields = found
        made = answer(*_taken(fields, arguments))
        return made if isinstance(made, dict) else await made

    def _time(self) -> dict[str, Any]:
        seconds, nanoseconds = divmod(self._system.clock.wall_ns(), 10**9)
        # clients of ROS 1's times look for the short names
        return {"time": {"sec": seconds, "nanosec": nanoseconds, "secs": seconds, "nsecs": nanoseconds}}

    def _version(self) -> dict[str, Any]:
        return {"version": 2, "distro": "lyrical"}


def _taken(fields: tuple[str, ...], arguments: Any) -> list[str]:
    """The texts of a request; what is missing is empty."""
    given = by_name(fields, arguments)
    values: list[Any] = [given.get(field, "") for field in fields]
    if not all(isinstance(value, str) for value in values):
        raise Refused(f"{', '.join(fields)}: texts are expected")
    return values
