"""service_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated, ClassVar

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import Exactly, char_array, default, int64, uint8

__all__ = [
    "ServiceEventInfo",
]


class ServiceEventInfo(Message, frozen=True, kw_only=True):
    """service_msgs/msg/ServiceEventInfo"""

    REQUEST_SENT: ClassVar[uint8] = 0
    REQUEST_RECEIVED: ClassVar[uint8] = 1
    RESPONSE_SENT: ClassVar[uint8] = 2
    RESPONSE_RECEIVED: ClassVar[uint8] = 3

    event_type: uint8 = 0
    stamp: Time = default()
    client_gid: Annotated[char_array, Exactly(16)] = default()
    sequence_number: int64 = 0
