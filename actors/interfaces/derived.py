"""The types that ROS 2 derives from every service and action, made when somebody asks for them.

A service `S` has `S_Event`; an action `A` has the services `A_SendGoal` and `A_GetResult` and the message
`A_FeedbackMessage`. They travel on the wire, so they have names, encodings and hashes; users of an action never see
them.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from actors.interfaces import registry, types
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import ActionType, Message, ServiceType, make_message
from actors.interfaces.naming import full_name
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from actors.interfaces.unique_identifier_msgs.msg import UUID

ServiceClass: TypeAlias = type[ServiceType[Any, Any]]
ActionClass: TypeAlias = type[ActionType[Any, Any, Any]]


def event_message(service: ServiceClass) -> type[Message]:
    """`S_Event`: ServiceEventInfo info, S_Request[<=1] request, S_Response[<=1] response; for service introspection."""
    parts: Any = service
    many: Any = types.Many
    return _message(
        f"{service.__ros_type__}_Event",
        {
            "info": ServiceEventInfo,
            "request": Annotated[many[parts.Request], types.AtMost(1)],
            "response": Annotated[many[parts.Response], types.AtMost(1)],
        },
    )


def send_goal_service(action: ActionClass) -> ServiceClass:
    """`A_SendGoal`: UUID goal_id, A_Goal goal --- bool accepted, Time stamp."""
    parts: Any = action
    return _service(
        f"{action.__ros_type__}_SendGoal",
        {"goal_id": UUID, "goal": parts.Goal},
        {"accepted": bool, "stamp": Time},
    )


def get_result_service(action: ActionClass) -> ServiceClass:
    """`A_GetResult`: UUID goal_id --- int8 status, A_Result result."""
    parts: Any = action
    return _service(
        f"{action.__ros_type__}_GetResult", {"goal_id": UUID}, {"status": types.int8, "result": parts.Result}
    )


def feedback_message(action: ActionClass) -> type[Message]:
    """`A_FeedbackMessage`: UUID goal_id, A_Feedback feedback."""
    parts: Any = action
    return _message(f"{action.__ros_type__}_FeedbackMessage", {"goal_id": UUID, "feedback": parts.Feedback})


def _message(ros_type: str, annotations: dict[str, object]) -> type[Message]:
    known: type[Message] | None = registry.known(ros_type)
    if known is not None:
        return known
    package, kind, name = full_name(ros_type).split("/")
    body: dict[str, object] = {field: types.default() for field in annotations}
    body |= {"__module__": f"{package}.{kind}", "__qualname__": name, "__annotations__": annotations}
    body |= {"__ros_type__": ros_type, "__doc__": f"{ros_type}, derived.", "__ros_source__": "derived"}
    return make_message(name, body)


def _service(ros_type: str, request: dict[str, object], response: dict[str, object]) -> ServiceClass:
    known: ServiceClass | None = registry.known(ros_type)
    if known is not None:
        return known
    base: Any = ServiceType
    parts = _message(f"{ros_type}_Request", request), _message(f"{ros_type}_Response", response)
    package, kind, name = full_name(ros_type).split("/")
    body: dict[str, object] = {
        "__module__": f"{package}.{kind}",
        "__ros_type__": ros_type,
        "__orig_bases__": (base[parts],),
    }
    return type(name, (base,), body | {"__doc__": f"{ros_type}, derived.", "__ros_source__": "derived"})
