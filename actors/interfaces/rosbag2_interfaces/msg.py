"""rosbag2_interfaces/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.types import Many, default, string, uint64

__all__ = [
    "MessagesLostEvent",
    "MessagesLostEventTopicStat",
    "ReadSplitEvent",
    "WriteSplitEvent",
]


class MessagesLostEventTopicStat(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/msg/MessagesLostEventTopicStat

    The name of the topic on which the messages were lost
    """

    topic_name: string = ""
    messages_lost_in_transport: uint64 = 0
    """The number of messages lost since the last event on a DDS transport layer"""
    messages_lost_in_recorder: uint64 = 0
    """The number of messages lost since the last event in the Rosbag2 recorder"""


class MessagesLostEvent(Message, frozen=True, kw_only=True):
    """rosbag2_interfaces/msg/MessagesLostEvent

    The fully qualified node name of the event sender
    """

    node_name: string = ""
    messages_lost_statistics: Many[MessagesLostEventTopicStat] = default()
    """Per topic statistics about messages lost since the last event. Topics with no lost messages will not be included"""


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
