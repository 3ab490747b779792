"""What ROS 2 gives every node and every action besides what they declare: opened when somebody asks, so that nobody pays for silence.

Services `<node>/get_parameters` and its five siblings; `<action>/_action/send_goal`, `.../get_result`, `.../cancel_goal`; topics
`<action>/_action/status`, `<action>/_action/feedback`, `/parameter_events`, `/rosout`. They behave as if they had been there from the node's
start on: what is latched is filled in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.errors import Reject
from actors.services.server import Server
from actors.time.values import nanoseconds_of, stamp_of

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.graph.graph import ServiceEntry, TopicEntry
    from actors.lifecycle.node import LifecycleNode
    from actors.logs import LogRecord
    from actors.parameters import ParameterChange
    from actors.runtime.core import Core
    from actors.system import System
    from actors.topics.publisher import Publisher

__all__ = ["LIFECYCLE_SERVICES", "PARAMETER_EVENTS", "PARAMETER_SERVICES", "ROSOUT", "open_service", "open_topic"]

PARAMETER_SERVICES: Final = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
LIFECYCLE_SERVICES: Final = (
    "change_state",
    "get_state",
    "get_available_states",
    "get_available_transitions",
    "get_transition_graph",
)
PARAMETER_EVENTS: Final = "/parameter_events"
ROSOUT: Final = "/rosout"
ACTION: Final = "/_action/"
ROSOUT_SECONDS: Final = 10.0
"""For how long a log line is worth something to late listeners: the lifespan of `qos.ROSOUT`."""
AT_ONCE: Final = 1000
"""How many requests to one derived service may be open at once; a `get_result` waits for its goal's end."""


def open_service(system: System, entry: ServiceEntry) -> None:
    """Open `entry` if it is a derived service of a node or an action that lives now; else do nothing."""
    base, _, last = entry.name.rpartition("/")
    if last in PARAMETER_SERVICES:
        core = system.core_of(base)
        if core is not None:
            _open_parameter_service(core, entry, last)
    elif last in LIFECYCLE_SERVICES:
        core = system.core_of(base)
        if core is not None and core.node.managed:
            from actors.lifecycle.node import lifecycle_service

            type, handler = lifecycle_service(cast("LifecycleNode", core.node), last)
            _serve(core, entry, type, handler, entry.name, 0)
    elif ACTION in entry.name:
        action, _, verb = entry.name.rpartition(ACTION)
        known = system.graph.actions.get(action)
        if known is not None and known.server is not None:
            _open_action_service(_core_of(known.server), known.server, entry, verb)


def open_topic(system: System, entry: TopicEntry) -> None:
    """Begin to publish on `entry` if it is a derived topic; else do nothing."""
    if entry.name == PARAMETER_EVENTS:
        system.on_parameters = lambda core, change: _publish_change(core, entry, change)
    elif entry.name == ROSOUT:
        _open_rosout(system, entry)
    elif ACTION in entry.name:
        action, _, part = entry.name.rpartition(ACTION)
        known = system.graph.actions.get(action)
        if known is not None and known.server is not None:
            if part == "status":
                _open_status(_core_of(known.server), known.server, entry)
            elif part == "feedback":
                _open_feedback(_core_of(known.server), known.server, entry)


def _core_of(server: ActionServer) -> Core:
    """Who serves this action; also while it still starts, when its system does not count it as running."""
    return cast("Core", server.node)


def _serve(core: Core, entry: ServiceEntry, type: Any, handler: Any, label: str, concurrent: int) -> None:
    server = Server(core, entry, type, handler, label, concurrent)
    core.derived.append(server)
    entry.open(server)


# -- parameters -----------------------------------------------------------------------------------------------------------------


def _open_parameter_service(core: Core, entry: ServiceEntry, name: str) -> None:
    from actors.parameters.messages import PARAMETER_SERVICES as SERVICES

    service = next(service for service in SERVICES if service.name == name)

    def told(error: Exception) -> None:
        core.service_failed(entry.name, error)

    async def answer(request: Any) -> Any:
        if service.name.startswith("set_"):
            return service.answer(core.parameters, request, told)
        return service.answer(core.parameters, request)

    _serve(core, entry, service.type, answer, entry.name, 0)


def _publish_change(core: Core, entry: TopicEntry, change: ParameterChange) -> None:
    from actors.interfaces.rcl_interfaces.msg import ParameterEvent
    from actors.parameters.messages import to_event

    core.event_publisher(ParameterEvent, entry).publish(to_event(change, core.fqn, core.clock.stamp()))


# -- logs -----------------------------------------------------------------------------------------------------------------------


def _open_rosout(system: System, entry: TopicEntry) -> None:
    """Publish every log line from now on, and let late joiners have the newest ones."""
    if system.rosout is not None:
        return
    from actors.interfaces.rcl_interfaces.msg import Log
    from actors.logs import log_message

    def publish(record: LogRecord) -> None:
        core = system.core_of(record.node)
        if core is None:
            return
        message = log_message(record, system.clock.wall_ns_at(record.time))
        core.event_publisher(Log, system.graph.topic(ROSOUT)).publish(message)

    system.rosout = publish
    oldest = system.clock.now() - ROSOUT_SECONDS
    for record in system.records:
        if record.time >= oldest:
            publish(record)


# -- actions --------------------------------------------------------------------------------------------------------------------


def _open_action_service(core: Core, server: ActionServer, entry: ServiceEntry, verb: str) -> None:
    from actors.interfaces import derived as types
    from actors.interfaces.action_msgs.srv import CancelGoal

    async def send_goal(request: Any) -> Any:
        try:
            stamp_ns = await server.submit(request.goal_id.uuid.tobytes(), request.goal, None).future
        except Reject:
            return service.Response(accepted=False)
        return service.Response(accepted=True, stamp=stamp_of(stamp_ns))

    async def get_result(request: Any) -> Any:
        status, result = await server.result_of(request.goal_id.uuid.tobytes())
        return service.Response(status=int(status), result=server.action.result() if result is None else result)

    async def cancel_goal(request: Any) -> Any:
        info = request.goal_info
        stamp = nanoseconds_of(info.stamp)
        outcome = await server.cancel_goals(info.goal_id.uuid.tobytes(), stamp, "canceled by a client")
        goals = tuple(_goal_info(record.goal_id, stamp_of(record.stamp_ns)) for record in outcome.goals)
        return CancelGoal.Response(return_code=int(outcome.code), goals_canceling=goals)

    handlers: dict[str, tuple[Any, Any]] = {
        "send_goal": (types.send_goal_service, send_goal),
        "get_result": (types.get_result_service, get_result),
        "cancel_goal": (_cancel_goal_service, cancel_goal),
    }
    if verb in handlers:
        make, handler = handlers[verb]
        service: Any = make(server.action.type)
        _serve(core, entry, service, handler, entry.name, AT_ONCE)


def _cancel_goal_service(action: object) -> Any:
    from actors.interfaces.action_msgs.srv import CancelGoal

    return CancelGoal


def _goal_info(goal_id: bytes, stamp: Any) -> Any:
    from actors.interfaces.action_msgs.msg import GoalInfo
    from actors.interfaces.unique_identifier_msgs.msg import UUID

    return GoalInfo(goal_id=UUID(uuid=goal_id), stamp=stamp)


def _open_status(core: Core, server: ActionServer, entry: TopicEntry) -> None:
    """Publish the list of goals after every change; changes of one instant are told together."""
    if server.observers.status:
        return
    from actors.interfaces.action_msgs.msg import GoalStatus, GoalStatusArray

    publisher = core.event_publisher(GoalStatusArray, entry)
    pending = False

    def tell() -> None:
        nonlocal pending
        pending = False
        if publisher not in core.publishers:
            return
        publisher.publish(
            GoalStatusArray(
                status_list=tuple(
                    GoalStatus(
                        goal_info=_goal_info(record.goal_id, stamp_of(record.stamp_ns)),
                        status=int(record.status),
                    )
                    for record in server.table.records()
                )
            )
        )

    def changed() -> None:
        nonlocal pending
        if not pending:
            pending = True
            core.system.loop.call_soon(tell)

    server.observers.status.append(changed)
    tell()


def _open_feedback(core: Core, server: ActionServer, entry: TopicEntry) -> None:
    if server.observers.feedback:
        return
    from actors.interfaces import derived as types
    from actors.interfaces.unique_identifier_msgs.msg import UUID

    message: Any = types.feedback_message(server.action.type)
    publisher: Publisher[Any] = core.event_publisher(message, entry)

    def feed(goal_id: bytes, feedback: Any) -> None:
        publisher.publish(message(goal_id=UUID(uuid=goal_id), feedback=feedback))

    server.observers.feedback.append(feed)
