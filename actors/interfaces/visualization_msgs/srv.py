"""visualization_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, default, uint64

from .msg import InteractiveMarker

__all__ = [
    "GetInteractiveMarkers",
    "GetInteractiveMarkers_Request",
    "GetInteractiveMarkers_Response",
]


class GetInteractiveMarkers_Request(Message, frozen=True, kw_only=True):
    """visualization_msgs/srv/GetInteractiveMarkers_Request"""


class GetInteractiveMarkers_Response(Message, frozen=True, kw_only=True):
    """visualization_msgs/srv/GetInteractiveMarkers_Response"""

    sequence_number: uint64 = 0
    markers: Many[InteractiveMarker] = default()


class GetInteractiveMarkers(ServiceType[GetInteractiveMarkers_Request, GetInteractiveMarkers_Response]):
    """visualization_msgs/srv/GetInteractiveMarkers"""

    Request: TypeAlias = GetInteractiveMarkers_Request
    Response: TypeAlias = GetInteractiveMarkers_Response
