"""robot_arm_control/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, float64_array, string

__all__ = [
    "GetPosition",
    "GetPosition_Request",
    "GetPosition_Response",
]


class GetPosition_Request(Message, frozen=True, kw_only=True):
    """robot_arm_control/srv/GetPosition_Request

    Where the joints of an arm are now.
    """


class GetPosition_Response(Message, frozen=True, kw_only=True):
    """robot_arm_control/srv/GetPosition_Response"""

    joint_angles: float64_array = default()
    arm_status: string = ""


class GetPosition(ServiceType[GetPosition_Request, GetPosition_Response]):
    """robot_arm_control/srv/GetPosition"""

    Request: TypeAlias = GetPosition_Request
    Response: TypeAlias = GetPosition_Response
