"""robactor_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import PointStamped, PoseStamped
from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, string

__all__ = [
    "ConfirmObject",
    "ConfirmObject_Request",
    "ConfirmObject_Response",
    "GetPlace",
    "GetPlace_Request",
    "GetPlace_Response",
]


class ConfirmObject_Request(Message, frozen=True, kw_only=True):
    """robactor_msgs/srv/ConfirmObject_Request

    Whether the camera sees an object now, and where.
    """

    object_name: string = ""


class ConfirmObject_Response(Message, frozen=True, kw_only=True):
    """robactor_msgs/srv/ConfirmObject_Response"""

    success: bool = False
    message: string = ""
    position: PointStamped = default()
    """of its middle"""


class ConfirmObject(ServiceType[ConfirmObject_Request, ConfirmObject_Response]):
    """robactor_msgs/srv/ConfirmObject"""

    Request: TypeAlias = ConfirmObject_Request
    Response: TypeAlias = ConfirmObject_Response


class GetPlace_Request(Message, frozen=True, kw_only=True):
    """robactor_msgs/srv/GetPlace_Request

    Where a named place of the map is.
    """

    name: string = ""


class GetPlace_Response(Message, frozen=True, kw_only=True):
    """robactor_msgs/srv/GetPlace_Response"""

    success: bool = False
    pose: PoseStamped = default()
    message: string = ""
    """what was found; without success, the names that come closest"""


class GetPlace(ServiceType[GetPlace_Request, GetPlace_Response]):
    """robactor_msgs/srv/GetPlace"""

    Request: TypeAlias = GetPlace_Request
    Response: TypeAlias = GetPlace_Response
