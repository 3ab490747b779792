"""sensor_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, string

from .msg import CameraInfo

__all__ = [
    "SetCameraInfo",
    "SetCameraInfo_Request",
    "SetCameraInfo_Response",
]


class SetCameraInfo_Request(Message, frozen=True, kw_only=True):
    """sensor_msgs/srv/SetCameraInfo_Request"""

    camera_info: CameraInfo = default()


class SetCameraInfo_Response(Message, frozen=True, kw_only=True):
    """sensor_msgs/srv/SetCameraInfo_Response"""

    success: bool = False
    status_message: string = ""


class SetCameraInfo(ServiceType[SetCameraInfo_Request, SetCameraInfo_Response]):
    """sensor_msgs/srv/SetCameraInfo"""

    Request: TypeAlias = SetCameraInfo_Request
    Response: TypeAlias = SetCameraInfo_Response
