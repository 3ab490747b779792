"""rosbag2_interfaces/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.types import string

__all__ = [
    "ReadSplitEvent",
    "WriteSplitEvent",
]


class ReadSplitEvent(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/msg/ReadSplitEvent

    The full path of the file that was finished and closed
    """

    closed_file: string = ""
    opened_file: string = ""
    """The full path of the new file that was opened to continue playback"""
    node_name: string = ""
    """The fully qualified node name of the event sender"""


class WriteSplitEvent(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/msg/WriteSplitEvent

    The full path of the file that was finished and closed
    """

    closed_file: string = ""
    opened_file: string = ""
    """The full path of the new file that was created to continue recording"""
    node_name: string = ""
    """The fully qualified node name of the event sender"""
