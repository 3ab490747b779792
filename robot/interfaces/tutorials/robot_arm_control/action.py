"""robot_arm_control/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, float64, float64_array, string

__all__ = [
    "MoveArm",
    "MoveArm_Feedback",
    "MoveArm_Goal",
    "MoveArm_Result",
]


class MoveArm_Goal(Message, frozen=True, kw_only=True):
    """robot_arm_control/action/MoveArm_Goal

    Move all joints of an arm.
    Goal
    """

    target_angles: float64_array = default()


class MoveArm_Result(Message, frozen=True, kw_only=True):
    """robot_arm_control/action/MoveArm_Result

    Result
    """

    success: bool = False
    final_angles: float64_array = default()
    message: string = ""


class MoveArm_Feedback(Message, frozen=True, kw_only=True):
    """robot_arm_control/action/MoveArm_Feedback

    Feedback
    """

    current_angles: float64_array = default()
    progress_percentage: float64 = 0.0
    status: string = ""


class MoveArm(ActionType[MoveArm_Goal, MoveArm_Result, MoveArm_Feedback]):
    """robot_arm_control/action/MoveArm"""

    Goal: TypeAlias = MoveArm_Goal
    Result: TypeAlias = MoveArm_Result
    Feedback: TypeAlias = MoveArm_Feedback
