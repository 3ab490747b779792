"""diagnostic_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import Many, byte, default, string

__all__ = [
    "DiagnosticArray",
    "DiagnosticStatus",
    "KeyValue",
]


class KeyValue(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/msg/KeyValue"""

    key: string = ""
    value: string = ""


class DiagnosticStatus(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/msg/DiagnosticStatus"""

    OK: ClassVar[byte] = 0
    WARN: ClassVar[byte] = 1
    ERROR: ClassVar[byte] = 2
    STALE: ClassVar[byte] = 3

    level: byte = 0
    name: string = ""
    message: string = ""
    hardware_id: string = ""
    values: Many[KeyValue] = default()


class DiagnosticArray(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/msg/DiagnosticArray"""

    header: Header = default()
    status: Many[DiagnosticStatus] = default()
