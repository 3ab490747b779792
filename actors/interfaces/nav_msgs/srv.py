"""nav_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import ClassVar, TypeAlias

from actors.interfaces.geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import default, float32, string, uint8

from .msg import OccupancyGrid, Path

__all__ = [
    "GetMap",
    "GetMap_Request",
    "GetMap_Response",
    "GetPlan",
    "GetPlan_Request",
    "GetPlan_Response",
    "LoadMap",
    "LoadMap_Request",
    "LoadMap_Response",
    "SetMap",
    "SetMap_Request",
    "SetMap_Response",
]


class GetMap_Request(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/GetMap_Request"""


class GetMap_Response(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/GetMap_Response"""

    map: OccupancyGrid = default()


class GetMap(ServiceType[GetMap_Request, GetMap_Response]):
    """nav_msgs/srv/GetMap"""

    Request: TypeAlias = GetMap_Request
    Response: TypeAlias = GetMap_Response


class GetPlan_Request(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/GetPlan_Request"""

    start: PoseStamped = default()
    goal: PoseStamped = default()
    tolerance: float32 = 0.0


class GetPlan_Response(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/GetPlan_Response"""

    plan: Path = default()


class GetPlan(ServiceType[GetPlan_Request, GetPlan_Response]):
    """nav_msgs/srv/GetPlan"""

    Request: TypeAlias = GetPlan_Request
    Response: TypeAlias = GetPlan_Response


class LoadMap_Request(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/LoadMap_Request"""

    map_url: string = ""


class LoadMap_Response(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/LoadMap_Response"""

    RESULT_SUCCESS: ClassVar[uint8] = 0
    RESULT_MAP_DOES_NOT_EXIST: ClassVar[uint8] = 1
    RESULT_INVALID_MAP_DATA: ClassVar[uint8] = 2
    RESULT_INVALID_MAP_METADATA: ClassVar[uint8] = 3
    RESULT_UNDEFINED_FAILURE: ClassVar[uint8] = 255

    map: OccupancyGrid = default()
    result: uint8 = 0


class LoadMap(ServiceType[LoadMap_Request, LoadMap_Response]):
    """nav_msgs/srv/LoadMap"""

    Request: TypeAlias = LoadMap_Request
    Response: TypeAlias = LoadMap_Response


class SetMap_Request(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/SetMap_Request"""

    map: OccupancyGrid = default()
    initial_pose: PoseWithCovarianceStamped = default()


class SetMap_Response(Message, frozen=True, kw_only=True):
    """nav_msgs/srv/SetMap_Response"""

    success: bool = False


class SetMap(ServiceType[SetMap_Request, SetMap_Response]):
    """nav_msgs/srv/SetMap"""

    Request: TypeAlias = SetMap_Request
    Response: TypeAlias = SetMap_Response
