"""The standard services and topics that every ROS 2 node and action has. They are opened when they are first asked for.

Services: `<node>/get_parameters` and the five other parameter services; `<node>/get_type_description`; `<node>/get_logger_levels` and
`.../set_logger_levels` where the parameter `enable_logger_service` says so; `<action>/_action/send_goal`,
`.../get_result`, `.../cancel_goal`. Topics: `<action>/_action/status`, `<action>/_action/feedback`, `/parameter_events`, `/rosout`. They
behave as if they had been open since the node's start: messages that a transient-local topic would have kept are published on opening. Kinds
of nodes, such as lifecycle nodes, add services by `Node.__standard_service__`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, cast

from actors.runtime.standard_actions import ACTION_SERVICES, ACTION_TOPICS, AT_ONCE, serve_standard

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.graph.graph import TopicEntry
    from actors.graph.servers import ServiceEntry
    from actors.interfaces.message import Message
    from actors.interfaces.type_description_interfaces.srv import (
        GetTypeDescription_Request,
        GetTypeDescription_Response,
    )
    from actors.logs import LogRecord
    from actors.parameters import ParameterChange
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.runtime import Runtime
    from actors.services.peers import Served

PARAMETER_SERVICES: Final = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
TYPE_DESCRIPTION: Final = "get_type_description"
PARAMETER_EVENTS: Final = "/parameter_events"
ROSOUT: Final = "/rosout"
ACTION: Final = "/_action/"
ROSOUT_SECONDS: Final = 10.0
"""How long a log line is kept for late subscriptions, seconds: the lifespan of `qos.ROSOUT`."""


class StandardEndpoints:
    """The standard services and topics of one system.

    Invariants:

    - A standard endpoint of a node or action is opened when its name is first asked for, and closed at the end of the incarnation.
    - `_awaited` holds the names of services that were asked for before their node was running, by the name of the node.
    - `/rosout` and `/parameter_events`, which all nodes share, are opened once. A message on them is published by the node it is about.
    """

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        runtime.graph.open_standard_service = self.open_service
        runtime.graph.open_standard_topic = self.open_topic
        self._awaited: dict[str, set[str]] = {}
        self._watches = False
        """Whether it is told of nodes that have become ready: from the first service on that is awaited."""
        self._unopened: dict[str, Callable[[], None]] = {
            PARAMETER_EVENTS: self._open_parameter_events,
            ROSOUT: self._open_rosout,
        }

    def open_service(self, entry: ServiceEntry) -> None:
        """Open `entry` if it is a standard service of an open action server, or of a running node, or else when that node is running."""
        base, _, last = entry.name.rpartition("/")
        if ACTION in entry.name:
            server, verb = self._action_of(entry.name)
            if server is not None and verb in ACTION_SERVICES:
                serve_standard(_life_of(server), entry, *ACTION_SERVICES[verb](server), AT_ONCE)
        elif (life := self._runtime.directory.find(base)) is not None:
            offered = _OF_NODES.get(last, _own_service)
            if (service := offered(life, entry.name, last)) is not None:
                serve_standard(life, entry, *service)
        else:
            if not self._watches:
                self._watches = True
                self._runtime.observers.ready.append(self._node_ready)
            self._awaited.setdefault(base, set()).add(entry.name)

    def _node_ready(self, life: Incarnation) -> None:
        """Open the services of a node for which somebody waits already."""
        services = self._runtime.graph.services
        for name in sorted(self._awaited.pop(life.fqn, ())):
            if name in services:
                self.open_service(services[name])

    def open_topic(self, entry: TopicEntry) -> None:
        """Begin to publish on `entry` if it is a standard topic; else do nothing."""
        if entry.name in self._unopened:
            self._unopened.pop(entry.name)()
        elif ACTION in entry.name:
            server, part = self._action_of(entry.name)
            if server is not None and part in ACTION_TOPICS:
                ACTION_TOPICS[part](_life_of(server), server, entry)

    def _action_of(self, name: str) -> tuple[ActionServer | None, str]:
        """The server of the action that the name belongs to, or None, and the part of the name after ``/_action/``."""
        action, _, part = name.rpartition(ACTION)
        known = self._runtime.graph.actions.get(action)
        return (None if known is None else cast("ActionServer | None", known.local)), part

    def _open_parameter_events(self) -> None:
        graph = self._runtime.graph

        def publish(life: Incarnation, change: ParameterChange) -> None:
            from actors.interfaces.rcl_interfaces.msg import ParameterEvent
            from actors.parameters.messages import to_event

            publisher = life.endpoints.event_publisher(ParameterEvent, graph.topic(PARAMETER_EVENTS))
            publisher.publish(to_event(change, life.fqn, life.clock.stamp()))

        self._runtime.observers.parameters.append(publish)

    def _open_rosout(self) -> None:
        """Publish the log lines of the last `ROSOUT_SECONDS`, and every log line from now on."""
        from actors.interfaces.rcl_interfaces.msg import Log
        from actors.logs import log_message

        runtime = self._runtime

        def publish(record: LogRecord) -> None:
            life = runtime.directory.find(record.node)
            if life is not None:
                message = log_message(record, runtime.clock.wall_ns_at(record.time))
                life.endpoints.event_publisher(Log, runtime.graph.topic(ROSOUT)).publish(message)

        runtime.observers.sinks.insert(0, publish)
        oldest = runtime.clock.now() - ROSOUT_SECONDS
        for record in runtime.system_log.records:
            if record.time >= oldest:
                publish(record)


def _life_of(server: ActionServer) -> Incarnation:
    """The incarnation that serves this action, also while it is starting, when `Directory.find` does not find it yet."""
    return cast("Incarnation", server.node)


def _parameter_service(life: Incarnation, name: str, last: str) -> Served:
    """The type and the handler of one of the six parameter services."""
    from actors.parameters.messages import PARAMETER_SERVICES as SERVICES

    service = next(service for service in SERVICES if service.name == last)

    def failed(error: Exception) -> None:
        life.service_failed(name, error)

    async def answer(request: Message) -> Message:
        if service.name.startswith("set_"):
            return service.answer(life.parameters, request, failed)
        return service.answer(life.parameters, request)

    return service.type, answer


def _type_description_service(life: Incarnation, name: str, last: str) -> Served | None:
    """The type and the handler of the service that describes types, or None if a parameter of the node says that it has none."""
    from actors.interfaces.describing import described
    from actors.interfaces.type_description_interfaces.srv import GetTypeDescription

    if not life.parameters.value("start_type_description_service"):
        return None

    async def answer(request: GetTypeDescription_Request) -> GetTypeDescription_Response:
        return described(request)

    return GetTypeDescription, answer


def _logger_service(life: Incarnation, name: str, last: str) -> Served | None:
    """The type and the handler of one of the two services for the levels of loggers, or None for a node that is not told to have them."""
    if not life.serves_loggers:
        return None
    from actors.logs.services import LOGGER_SERVICES

    kind, answered = LOGGER_SERVICES[last]

    async def answer(request: Message) -> Message:
        return answered(life.runtime.system_log.levels, request)

    return kind, answer


def _own_service(life: Incarnation, name: str, last: str) -> Served | None:
    """The type and the handler of a service that this kind of node adds, or None."""
    return life.node.__standard_service__(last)


_OF_NODES: Final[Mapping[str, Callable[[Incarnation, str, str], Served | None]]] = MappingProxyType(
    {
        **dict.fromkeys(PARAMETER_SERVICES, _parameter_service),
        TYPE_DESCRIPTION: _type_description_service,
        **dict.fromkeys(("get_logger_levels", "set_logger_levels"), _logger_service),
    }
)
"""What offers each service that every node may have, by the last part of its name."""
