"""The types that ROS 2 derives from every service and action, made when somebody asks for them.

A service `S` has `S_Event`; an action `A` has the services `A_SendGoal` and `A_GetResult` and the message
`A_FeedbackMessage`. They travel on the wire, so they have names, encodings and hashes; users of an action never see
them.
"""

from __future__ import annotations

from typing import Annotated, Any

from actors.interfaces import registry, types
from actors.interfaces.message import ActionType, Message, ServiceType, make_message
from actors.interfaces.naming import full_name


def event_message(service: type[ServiceType[Any, Any]]) -> type[Message]:
    """`S_Event`: ServiceEventInfo info, S_Request[<=1] request, S_Response[<=1] response; for service introspection."""
    parts: Any = service
    many: Any = types.Many
    return _message(
        f"{service.__ros_type__}_Event",
        {
            "info": registry.get_message("service_msgs/msg/ServiceEventInfo"),
            "request": Annotated[many[parts.Request], types.AtMost(1)],
            "response": Annotated[many[parts.Response], types.AtMost(1)],
        },
    )


def send_goal_service(action: type[ActionType[Any, Any, Any]]) -> type[ServiceType[Any, Any]]:
    """`A_SendGoal`: UUID goal_id, A_Goal goal --- bool accepted, Time stamp."""
    parts: Any = action
    return _service(
        f"{action.__ros_type__}_SendGoal",
        {"goal_id": _uuid(), "goal": parts.Goal},
        {"accepted": bool, "stamp": registry.get_message("builtin_interfaces/msg/Time")},
    )


def get_result_service(action: type[ActionType[Any, Any, Any]]) -> type[ServiceType[Any, Any]]:
    """`A_GetResult`: UUID goal_id --- int8 status, A_Result result."""
    parts: Any = action
    return _service(
        f"{action.__ros_type__}_GetResult", {"goal_id": _uuid()}, {"status": types.int8, "result": parts.Result}
    )


def feedback_message(action: type[ActionType[Any, Any, Any]]) -> type[Message]:
    """`A_FeedbackMessage`: UUID goal_id, A_Feedback feedback."""
    parts: Any = action
    return _message(f"{action.__ros_type__}_FeedbackMessage", {"goal_id": _uuid(), "feedback": parts.Feedback})


def derive(name: str) -> type[Any] | None:
    """The derived type of this full name, or None where it is not the name of one."""
    for suffix, make in (("_SendGoal", send_goal_service), ("_GetResult", get_result_service)):
        stem, found, part = name.partition(suffix)
        if found:
            action = _find(stem, ActionType)
            if action is None:
                return None
            service: Any = make(action)
            if part == "_Event":
                return event_message(service)
            return service if not part else getattr(service, part.removeprefix("_"), None)
    stem, found, part = name.rpartition("_")
    if found and part == "Event" and (parent := _find(stem, ServiceType)) is not None:
        return event_message(parent)
    if found and part == "FeedbackMessage" and (parent := _find(stem, ActionType)) is not None:
        return feedback_message(parent)
    return None


def _find(name: str, base: type[Any]) -> Any:
    cls = registry.find(name)
    return cls if cls is not None and issubclass(cls, base) else None


def _uuid() -> type[Message]:
    return registry.get_message("unique_identifier_msgs/msg/UUID")


def _message(ros_type: str, annotations: dict[str, Any]) -> type[Message]:
    known: type[Message] | None = registry.known(ros_type)
    if known is not None:
        return known
    package, kind, name = full_name(ros_type).split("/")
    body: dict[str, Any] = {field: types.default() for field in annotations}
    body |= {"__module__": f"{package}.{kind}", "__qualname__": name, "__annotations__": annotations}
    body |= {"__ros_type__": ros_type, "__doc__": f"{ros_type}, derived.", "__ros_source__": "derived"}
    return make_message(name, body)


def _service(ros_type: str, request: dict[str, Any], response: dict[str, Any]) -> type[ServiceType[Any, Any]]:
    known: type[ServiceType[Any, Any]] | None = registry.known(ros_type)
    if known is not None:
        return known
    base: Any = ServiceType
    parts = _message(f"{ros_type}_Request", request), _message(f"{ros_type}_Response", response)
    package, kind, name = full_name(ros_type).split("/")
    body: dict[str, Any] = {
        "__module__": f"{package}.{kind}",
        "__ros_type__": ros_type,
        "__orig_bases__": (base[parts],),
    }
    return type(name, (base,), body | {"__doc__": f"{ros_type}, derived.", "__ros_source__": "derived"})
