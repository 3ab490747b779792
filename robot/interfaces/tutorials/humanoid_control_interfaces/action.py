"""humanoid_control_interfaces/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, float32, string

__all__ = [
    "NavigateToGoal",
    "NavigateToGoal_Feedback",
    "NavigateToGoal_Goal",
    "NavigateToGoal_Result",
]


class NavigateToGoal_Goal(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/action/NavigateToGoal_Goal

    Walk to a pose.
    Goal
    """

    target_pose: PoseStamped = default()


class NavigateToGoal_Result(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/action/NavigateToGoal_Result

    Result
    """

    success: bool = False
    message: string = ""
    total_distance: float32 = 0.0


class NavigateToGoal_Feedback(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/action/NavigateToGoal_Feedback

    Feedback
    """

    current_pose: PoseStamped = default()
    distance_remaining: float32 = 0.0
    progress_percent: float32 = 0.0


class NavigateToGoal(ActionType[NavigateToGoal_Goal, NavigateToGoal_Result, NavigateToGoal_Feedback]):
    """humanoid_control_interfaces/action/NavigateToGoal"""

    Goal: TypeAlias = NavigateToGoal_Goal
    Result: TypeAlias = NavigateToGoal_Result
    Feedback: TypeAlias = NavigateToGoal_Feedback
