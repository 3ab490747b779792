"""my_robot_pkg/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, int32, int32_array

__all__ = [
    "Fibonacci",
    "Fibonacci_Feedback",
    "Fibonacci_Goal",
    "Fibonacci_Result",
]


class Fibonacci_Goal(Message, frozen=True, kw_only=True):
    """my_robot_pkg/action/Fibonacci_Goal

    The fields are those of example_interfaces/action/Fibonacci; the tutorial uses this type without printing it.
    Goal
    """

    order: int32 = 0


class Fibonacci_Result(Message, frozen=True, kw_only=True):
    """my_robot_pkg/action/Fibonacci_Result

    Result
    """

    sequence: int32_array = default()


class Fibonacci_Feedback(Message, frozen=True, kw_only=True):
    """my_robot_pkg/action/Fibonacci_Feedback

    Feedback
    """

    sequence: int32_array = default()


class Fibonacci(ActionType[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]):
    """my_robot_pkg/action/Fibonacci"""

    Goal: TypeAlias = Fibonacci_Goal
    Result: TypeAlias = Fibonacci_Result
    Feedback: TypeAlias = Fibonacci_Feedback
