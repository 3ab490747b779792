"""my_robot_pkg/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import float64, string

__all__ = [
    "CalculateDistance",
    "CalculateDistance_Request",
    "CalculateDistance_Response",
]


class CalculateDistance_Request(Message, frozen=True, kw_only=True):
    """my_robot_pkg/srv/CalculateDistance_Request

    Distance between two points in the plane.
    """

    x1: float64 = 0.0
    y1: float64 = 0.0
    x2: float64 = 0.0
    y2: float64 = 0.0


class CalculateDistance_Response(Message, frozen=True, kw_only=True):
    """my_robot_pkg/srv/CalculateDistance_Response"""

    distance: float64 = 0.0
    success: bool = False
    message: string = ""


class CalculateDistance(ServiceType[CalculateDistance_Request, CalculateDistance_Response]):
    """my_robot_pkg/srv/CalculateDistance"""

    Request: TypeAlias = CalculateDistance_Request
    Response: TypeAlias = CalculateDistance_Response
