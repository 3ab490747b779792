"""proposed_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, float64, int32, string

__all__ = [
    "GetAverageTemperature",
    "GetAverageTemperature_Request",
    "GetAverageTemperature_Response",
    "GetRobotPose",
    "GetRobotPose_Request",
    "GetRobotPose_Response",
]


class GetAverageTemperature_Request(Message, frozen=True, kw_only=True):
    """proposed_interfaces/srv/GetAverageTemperature_Request

    The tutorials name this service but do not define it; the definition is a proposal of this project.
    """

    count: int32 = 0


class GetAverageTemperature_Response(Message, frozen=True, kw_only=True):
    """proposed_interfaces/srv/GetAverageTemperature_Response"""

    success: bool = False
    average: float64 = 0.0
    samples: int32 = 0
    message: string = ""


class GetAverageTemperature(ServiceType[GetAverageTemperature_Request, GetAverageTemperature_Response]):
    """proposed_interfaces/srv/GetAverageTemperature"""

    Request: TypeAlias = GetAverageTemperature_Request
    Response: TypeAlias = GetAverageTemperature_Response


class GetRobotPose_Request(Message, frozen=True, kw_only=True):
    """proposed_interfaces/srv/GetRobotPose_Request

    The tutorials name this service but do not define it; the definition is a proposal of this project.
    """


class GetRobotPose_Response(Message, frozen=True, kw_only=True):
    """proposed_interfaces/srv/GetRobotPose_Response"""

    success: bool = False
    pose: PoseStamped = default()
    message: string = ""


class GetRobotPose(ServiceType[GetRobotPose_Request, GetRobotPose_Response]):
    """proposed_interfaces/srv/GetRobotPose"""

    Request: TypeAlias = GetRobotPose_Request
    Response: TypeAlias = GetRobotPose_Response
