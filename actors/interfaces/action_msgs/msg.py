"""action_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import Many, default, int8
from actors.interfaces.unique_identifier_msgs.msg import UUID

__all__ = [
    "GoalInfo",
    "GoalStatus",
    "GoalStatusArray",
]


class GoalInfo(Message, frozen=True, kw_only=True):
    """action_msgs/msg/GoalInfo"""

    goal_id: UUID = default()
    stamp: Time = default()


class GoalStatus(Message, frozen=True, kw_only=True):
    """action_msgs/msg/GoalStatus"""

    STATUS_UNKNOWN: ClassVar[int8] = 0
    STATUS_ACCEPTED: ClassVar[int8] = 1
    STATUS_EXECUTING: ClassVar[int8] = 2
    STATUS_CANCELING: ClassVar[int8] = 3
    STATUS_SUCCEEDED: ClassVar[int8] = 4
    STATUS_CANCELED: ClassVar[int8] = 5
    STATUS_ABORTED: ClassVar[int8] = 6

    goal_info: GoalInfo = default()
    status: int8 = 0


class GoalStatusArray(Message, frozen=True, kw_only=True):
    """action_msgs/msg/GoalStatusArray"""

    status_list: Many[GoalStatus] = default()
