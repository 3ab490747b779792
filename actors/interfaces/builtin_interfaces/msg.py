"""builtin_interfaces/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32

__all__ = [
    "Duration",
    "Time",
]


class Duration(Message, frozen=True, kw_only=True):
    """builtin_interfaces/msg/Duration"""

    sec: int32 = 0
    nanosec: uint32 = 0


class Time(Message, frozen=True, kw_only=True):
    """builtin_interfaces/msg/Time"""

    sec: int32 = 0
    nanosec: uint32 = 0
