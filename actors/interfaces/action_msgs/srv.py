"""action_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import ClassVar, TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, default, int8

from .msg import GoalInfo

__all__ = [
    "CancelGoal",
    "CancelGoal_Request",
    "CancelGoal_Response",
]


class CancelGoal_Request(Message, frozen=True, kw_only=True):
    """action_msgs/srv/CancelGoal_Request"""

    goal_info: GoalInfo = default()


class CancelGoal_Response(Message, frozen=True, kw_only=True):
    """action_msgs/srv/CancelGoal_Response"""

    ERROR_NONE: ClassVar[int8] = 0
    ERROR_REJECTED: ClassVar[int8] = 1
    ERROR_UNKNOWN_GOAL_ID: ClassVar[int8] = 2
    ERROR_GOAL_TERMINATED: ClassVar[int8] = 3

    return_code: int8 = 0
    goals_canceling: Many[GoalInfo] = default()


class CancelGoal(ServiceType[CancelGoal_Request, CancelGoal_Response]):
    """action_msgs/srv/CancelGoal"""

    Request: TypeAlias = CancelGoal_Request
    Response: TypeAlias = CancelGoal_Response
