"""The standard services and topics of every action: those below ``<action>/_action/``."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any, Final

from actors.errors import Reject
from actors.time.values import nanoseconds_of, stamp_of

if TYPE_CHECKING:
    from actors.actions.goals import GoalRecord
    from actors.actions.server import ActionServer
    from actors.graph.graph import TopicEntry
    from actors.graph.servers import ServiceEntry
    from actors.interfaces.action_msgs.msg import GoalInfo
    from actors.interfaces.action_msgs.srv import CancelGoal_Request, CancelGoal_Response
    from actors.interfaces.message import Message, Req, Resp, ServiceType
    from actors.runtime.incarnation import Incarnation
    from actors.services.peers import Served
    from actors.topics.publisher import Publisher

AT_ONCE: Final = 1000
"""How many requests one service of an action handles at once; a `get_result` request waits for the end of its goal."""

FEW: Final = 16
PACE: Final = 1e-4
"""A status list of more than `FEW` goals is published at most once in `PACE` seconds a goal. It contains the goals whose results are kept, too: without a
pace, a thousand goals a second would cost lists of ten thousand goals a thousand times a second."""


def serve_standard(
    life: Incarnation,
    entry: ServiceEntry,
    type: type[ServiceType[Req, Resp]],
    handler: Callable[[Any], Awaitable[Message]],
    concurrent: int = 0,
) -> None:
    """Serve `entry` from now until the end of this incarnation, besides what its node declares."""
    server = life.endpoints.server(entry, type, handler, entry.name, concurrent, declared=False)
    life.endpoints.standard += (server,)
    entry.open(server)


def _goal_info(goal_id: bytes, stamp_ns: int) -> GoalInfo:
    from actors.interfaces.action_msgs.msg import GoalInfo
    from actors.interfaces.unique_identifier_msgs.msg import UUID

    return GoalInfo(goal_id=UUID(uuid=goal_id), stamp=stamp_of(stamp_ns))


# -- services -------------------------------------------------------------------------------------------------------------------


def _send_goal(server: ActionServer) -> Served:
    from actors.interfaces import derived as types

    service: Any = types.send_goal_service(server.action.type)

    async def send_goal(request: Any) -> Any:
        try:
            stamp_ns = await server.submit(request.goal_id.uuid.tobytes(), request.goal, None).future
        except Reject:
            return service.Response(accepted=False)
        return service.Response(accepted=True, stamp=stamp_of(stamp_ns))

    return service, send_goal


def _get_result(server: ActionServer) -> Served:
    from actors.interfaces import derived as types

    service: Any = types.get_result_service(server.action.type)

    async def get_result(request: Any) -> Any:
        status, result = await server.result_of(request.goal_id.uuid.tobytes())
        return service.Response(status=int(status), result=server.action.result() if result is None else result)

    return service, get_result


def _cancel_goal(server: ActionServer) -> Served:
    from actors.interfaces.action_msgs.srv import CancelGoal

    async def cancel_goal(request: CancelGoal_Request) -> CancelGoal_Response:
        info = request.goal_info
        stamp = nanoseconds_of(info.stamp)
        outcome = await server.cancel_goals(info.goal_id.uuid.tobytes(), stamp, "canceled by a client")
        goals = tuple(_goal_info(record.goal_id, record.stamp_ns) for record in outcome.goals)
        return CancelGoal.Response(return_code=int(outcome.code), goals_canceling=goals)

    return CancelGoal, cancel_goal


ACTION_SERVICES: Final[dict[str, Callable[[ActionServer], Served]]] = {
    "send_goal": _send_goal,
    "get_result": _get_result,
    "cancel_goal": _cancel_goal,
}
"""The part of a service's name after ``/_action/`` -> its type and handler for a server."""


# -- topics ---------------------------------------------------------------------------------------------------------------------


def _open_status(life: Incarnation, server: ActionServer, entry: TopicEntry) -> None:
    """Publish the list of goals now and after every change; changes in one turn of the event loop, or within the `PACE`, are published together."""
    if server.on_status:
        return
    from actors.interfaces.action_msgs.msg import GoalStatus, GoalStatusArray

    publisher = life.endpoints.event_publisher(GoalStatusArray, entry)
    loop, next_at, pending = life.runtime.loop, 0.0, False
    told: dict[bytes, GoalStatus] = {}

    def status_of(record: GoalRecord) -> GoalStatus:
        known = told.get(record.goal_id)
        if known is None or known.status != record.status:
            info = _goal_info(record.goal_id, record.stamp_ns) if known is None else known.goal_info
            return GoalStatus(goal_info=info, status=int(record.status))
        return known

    def tell() -> None:
        nonlocal next_at, pending, told
        pending = False
        if publisher not in life.endpoints.publishers:
            return
        told = {record.goal_id: status_of(record) for record in server.table.records()}
        next_at = loop.time() + len(told) * PACE if len(told) > FEW else 0.0
        publisher.publish(GoalStatusArray(status_list=tuple(told.values())))

    def changed() -> None:
        nonlocal pending
        if not pending:
            pending = True
            if loop.time() < next_at:
                loop.call_at(next_at, tell)
            else:
                loop.call_soon(tell)

    server.on_status.append(changed)
    tell()


def _open_feedback(life: Incarnation, server: ActionServer, entry: TopicEntry) -> None:
    if server.on_feedback:
        return
    from actors.interfaces import derived as types
    from actors.interfaces.unique_identifier_msgs.msg import UUID

    message: Any = types.feedback_message(server.action.type)
    publisher: Publisher[Message] = life.endpoints.event_publisher(message, entry)

    def feed(goal_id: bytes, feedback: object) -> None:
        publisher.publish(message(goal_id=UUID(uuid=goal_id), feedback=feedback))

    server.on_feedback.append(feed)


ACTION_TOPICS: Final[dict[str, Callable[[Incarnation, ActionServer, TopicEntry], None]]] = {
    "status": _open_status,
    "feedback": _open_feedback,
}
"""The part of a topic's name after ``/_action/`` -> the function that begins to publish on it."""
