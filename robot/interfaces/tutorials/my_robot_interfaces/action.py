"""my_robot_interfaces/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import float32, string

__all__ = [
    "MoveToPosition",
    "MoveToPosition_Feedback",
    "MoveToPosition_Goal",
    "MoveToPosition_Result",
]


class MoveToPosition_Goal(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/action/MoveToPosition_Goal

    Move to a position in the plane. The result has no final_theta although the goal has target_theta.
    Goal
    """

    target_x: float32 = 0.0
    target_y: float32 = 0.0
    target_theta: float32 = 0.0


class MoveToPosition_Result(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/action/MoveToPosition_Result

    Result
    """

    success: bool = False
    final_x: float32 = 0.0
    final_y: float32 = 0.0
    total_time_seconds: float32 = 0.0
    message: string = ""


class MoveToPosition_Feedback(Message, frozen=True, kw_only=True):
    """my_robot_interfaces/action/MoveToPosition_Feedback

    Feedback
    """

    current_x: float32 = 0.0
    current_y: float32 = 0.0
    distance_remaining: float32 = 0.0
    estimated_time_remaining: float32 = 0.0


class MoveToPosition(ActionType[MoveToPosition_Goal, MoveToPosition_Result, MoveToPosition_Feedback]):
    """my_robot_interfaces/action/MoveToPosition"""

    Goal: TypeAlias = MoveToPosition_Goal
    Result: TypeAlias = MoveToPosition_Result
    Feedback: TypeAlias = MoveToPosition_Feedback
