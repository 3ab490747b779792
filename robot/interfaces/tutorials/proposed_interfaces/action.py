"""proposed_interfaces/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, float64, string

__all__ = [
    "NavigateAndGrab",
    "NavigateAndGrab_Feedback",
    "NavigateAndGrab_Goal",
    "NavigateAndGrab_Result",
]


class NavigateAndGrab_Goal(Message, frozen=True, kw_only=True):
    """proposed_interfaces/action/NavigateAndGrab_Goal

    The tutorials name this action but do not define it; the definition is a proposal of this project.
    Goal
    """

    object_name: string = ""
    target_pose: PoseStamped = default()


class NavigateAndGrab_Result(Message, frozen=True, kw_only=True):
    """proposed_interfaces/action/NavigateAndGrab_Result

    Result
    """

    success: bool = False
    held_object: string = ""
    final_pose: PoseStamped = default()
    message: string = ""


class NavigateAndGrab_Feedback(Message, frozen=True, kw_only=True):
    """proposed_interfaces/action/NavigateAndGrab_Feedback

    Feedback
    """

    stage: string = ""
    distance_remaining: float64 = 0.0
    progress_percent: float64 = 0.0


class NavigateAndGrab(ActionType[NavigateAndGrab_Goal, NavigateAndGrab_Result, NavigateAndGrab_Feedback]):
    """proposed_interfaces/action/NavigateAndGrab"""

    Goal: TypeAlias = NavigateAndGrab_Goal
    Result: TypeAlias = NavigateAndGrab_Result
    Feedback: TypeAlias = NavigateAndGrab_Feedback
