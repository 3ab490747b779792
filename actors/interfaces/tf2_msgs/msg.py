"""tf2_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.message import Message
from actors.interfaces.types import Many, default, string, uint8

__all__ = [
    "TF2Error",
    "TFMessage",
]


class TF2Error(Message, frozen=True, kw_only=True):
    """tf2_msgs/msg/TF2Error"""

    NO_ERROR: ClassVar[uint8] = 0
    LOOKUP_ERROR: ClassVar[uint8] = 1
    CONNECTIVITY_ERROR: ClassVar[uint8] = 2
    EXTRAPOLATION_ERROR: ClassVar[uint8] = 3
    INVALID_ARGUMENT_ERROR: ClassVar[uint8] = 4
    TIMEOUT_ERROR: ClassVar[uint8] = 5
    TRANSFORM_ERROR: ClassVar[uint8] = 6

    error: uint8 = 0
    error_string: string = ""


class TFMessage(Message, frozen=True, kw_only=True):
    """tf2_msgs/msg/TFMessage"""

    transforms: Many[TransformStamped] = default()
