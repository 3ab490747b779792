"""lifecycle_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, default

from .msg import State, Transition, TransitionDescription

__all__ = [
    "ChangeState",
    "ChangeState_Request",
    "ChangeState_Response",
    "GetAvailableStates",
    "GetAvailableStates_Request",
    "GetAvailableStates_Response",
    "GetAvailableTransitions",
    "GetAvailableTransitions_Request",
    "GetAvailableTransitions_Response",
    "GetState",
    "GetState_Request",
    "GetState_Response",
]


class ChangeState_Request(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/ChangeState_Request"""

    transition: Transition = default()


class ChangeState_Response(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/ChangeState_Response"""

    success: bool = False


class ChangeState(ServiceType[ChangeState_Request, ChangeState_Response]):
    """lifecycle_msgs/srv/ChangeState"""

    Request: TypeAlias = ChangeState_Request
    Response: TypeAlias = ChangeState_Response


class GetAvailableStates_Request(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetAvailableStates_Request"""


class GetAvailableStates_Response(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetAvailableStates_Response"""

    available_states: Many[State] = default()


class GetAvailableStates(ServiceType[GetAvailableStates_Request, GetAvailableStates_Response]):
    """lifecycle_msgs/srv/GetAvailableStates"""

    Request: TypeAlias = GetAvailableStates_Request
    Response: TypeAlias = GetAvailableStates_Response


class GetAvailableTransitions_Request(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetAvailableTransitions_Request"""


class GetAvailableTransitions_Response(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetAvailableTransitions_Response"""

    available_transitions: Many[TransitionDescription] = default()


class GetAvailableTransitions(ServiceType[GetAvailableTransitions_Request, GetAvailableTransitions_Response]):
    """lifecycle_msgs/srv/GetAvailableTransitions"""

    Request: TypeAlias = GetAvailableTransitions_Request
    Response: TypeAlias = GetAvailableTransitions_Response


class GetState_Request(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetState_Request"""


class GetState_Response(Message, frozen=True, kw_only=True):
    """lifecycle_msgs/srv/GetState_Response"""

    current_state: State = default()


class GetState(ServiceType[GetState_Request, GetState_Response]):
    """lifecycle_msgs/srv/GetState"""

    Request: TypeAlias = GetState_Request
    Response: TypeAlias = GetState_Response
