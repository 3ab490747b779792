"""rmw_dds_common/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.types import Chars, Exactly, Many, char_array, default, string

__all__ = [
    "Gid",
    "NodeEntitiesInfo",
    "ParticipantEntitiesInfo",
]


class Gid(Message, frozen=True, kw_only=True):
    """rmw_dds_common/msg/Gid"""

    data: Annotated[char_array, Exactly(16)] = default()


class NodeEntitiesInfo(Message, frozen=True, kw_only=True):
    """rmw_dds_common/msg/NodeEntitiesInfo"""

    node_namespace: Annotated[string, Chars(256)] = ""
    node_name: Annotated[string, Chars(256)] = ""
    reader_gid_seq: Many[Gid] = default()
    writer_gid_seq: Many[Gid] = default()


class ParticipantEntitiesInfo(Message, frozen=True, kw_only=True):
    """rmw_dds_common/msg/ParticipantEntitiesInfo"""

    gid: Gid = default()
    node_entities_info_seq: Many[NodeEntitiesInfo] = default()
