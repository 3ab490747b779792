"""tf2_msgs/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.builtin_interfaces.msg import Duration, Time
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, string

from .msg import TF2Error

__all__ = [
    "LookupTransform",
    "LookupTransform_Feedback",
    "LookupTransform_Goal",
    "LookupTransform_Result",
]


class LookupTransform_Goal(Message, frozen=True, kw_only=True):
    """tf2_msgs/action/LookupTransform_Goal"""

    target_frame: string = ""
    source_frame: string = ""
    source_time: Time = default()
    timeout: Duration = default()
    target_time: Time = default()
    fixed_frame: string = ""
    advanced: bool = False


class LookupTransform_Result(Message, frozen=True, kw_only=True):
    """tf2_msgs/action/LookupTransform_Result"""

    transform: TransformStamped = default()
    error: TF2Error = default()


class LookupTransform_Feedback(Message, frozen=True, kw_only=True):
    """tf2_msgs/action/LookupTransform_Feedback"""


class LookupTransform(ActionType[LookupTransform_Goal, LookupTransform_Result, LookupTransform_Feedback]):
    """tf2_msgs/action/LookupTransform"""

    Goal: TypeAlias = LookupTransform_Goal
    Result: TypeAlias = LookupTransform_Result
    Feedback: TypeAlias = LookupTransform_Feedback
