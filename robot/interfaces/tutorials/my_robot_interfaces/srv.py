"""my_robot_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import float32, string

__all__ = [
    "GetBatteryStatus",
    "GetBatteryStatus_Request",
    "GetBatteryStatus_Response",
]


class GetBatteryStatus_Request(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/srv/GetBatteryStatus_Request

    State of the battery of one robot.
    """

    robot_id: string = ""


class GetBatteryStatus_Response(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/srv/GetBatteryStatus_Response"""

    voltage: float32 = 0.0
    percentage: float32 = 0.0
    estimated_runtime_minutes: float32 = 0.0
    health_status: string = ""
    is_charging: bool = False


class GetBatteryStatus(ServiceType[GetBatteryStatus_Request, GetBatteryStatus_Response]):
    """my_robot_interfaces/srv/GetBatteryStatus"""

    Request: TypeAlias = GetBatteryStatus_Request
    Response: TypeAlias = GetBatteryStatus_Response
