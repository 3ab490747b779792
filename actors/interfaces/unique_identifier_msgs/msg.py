"""unique_identifier_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.types import Exactly, default, uint8_array

__all__ = [
    "UUID",
]


class UUID(Message, frozen=True, kw_only=True):
    """unique_identifier_msgs/msg/UUID"""

    uuid: Annotated[uint8_array, Exactly(16)] = default()
