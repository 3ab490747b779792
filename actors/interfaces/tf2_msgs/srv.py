"""tf2_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import string

__all__ = [
    "FrameGraph",
    "FrameGraph_Request",
    "FrameGraph_Response",
]


class FrameGraph_Request(Message, frozen=True, kw_only=True):
    """tf2_msgs/srv/FrameGraph_Request"""


class FrameGraph_Response(Message, frozen=True, kw_only=True):
    """tf2_msgs/srv/FrameGraph_Response"""

    frame_yaml: string = ""


class FrameGraph(ServiceType[FrameGraph_Request, FrameGraph_Response]):
    """tf2_msgs/srv/FrameGraph"""

    Request: TypeAlias = FrameGraph_Request
    Response: TypeAlias = FrameGraph_Response
