"""your_package/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, float64, float64_array, int32, string

__all__ = [
    "HumanoidNav",
    "HumanoidNav_Feedback",
    "HumanoidNav_Goal",
    "HumanoidNav_Result",
]


class HumanoidNav_Goal(Message, frozen=True, kw_only=True):
    """your_package/action/HumanoidNav_Goal

    Walk to a pose. From a tutorial, whose own placeholder name the package is.
    Goal: target_position is x, y, theta
    """

    target_position: float64_array = default()
    avoid_obstacles: bool = False


class HumanoidNav_Result(Message, frozen=True, kw_only=True):
    """your_package/action/HumanoidNav_Result

    Result: final_position is the actual final x, y, theta
    """

    success: bool = False
    final_position: float64_array = default()
    message: string = ""


class HumanoidNav_Feedback(Message, frozen=True, kw_only=True):
    """your_package/action/HumanoidNav_Feedback

    Feedback
    """

    current_waypoint: int32 = 0
    current_position: float64_array = default()
    distance_remaining: float64 = 0.0
    status_message: string = ""


class HumanoidNav(ActionType[HumanoidNav_Goal, HumanoidNav_Result, HumanoidNav_Feedback]):
    """your_package/action/HumanoidNav"""

    Goal: TypeAlias = HumanoidNav_Goal
    Result: TypeAlias = HumanoidNav_Result
    Feedback: TypeAlias = HumanoidNav_Feedback
