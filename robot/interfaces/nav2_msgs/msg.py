"""nav2_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import Message
from actors.interfaces.types import default, string, uint8, uint16, uint32

__all__ = [
    "WaypointStatus",
]


class WaypointStatus(Message, frozen=True, kw_only=True):
    """nav2_msgs/msg/WaypointStatus

    Waypoint state for multi-goal navigation or waypoint following
    """

    PENDING: ClassVar[uint8] = 0
    COMPLETED: ClassVar[uint8] = 1
    SKIPPED: ClassVar[uint8] = 2
    FAILED: ClassVar[uint8] = 3

    waypoint_status: uint8 = 0
    waypoint_index: uint32 = 0
    waypoint_pose: PoseStamped = default()
    error_code: uint16 = 0
    error_msg: string = ""
