"""Names of types as parts of a key expression: ``std_msgs/msg/String`` is written ``std_msgs::msg::dds_::String_``.

A service is written by its own name, an action by those of its parts: ``pkg::action::dds_::Name_SendGoal_``, ``..Name_GetResult_``,
``..Name_FeedbackMessage_``.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final

from actors.transport.format.errors import refuse

NO_TYPE_HASH: Final = "TypeHashNotSupported"
"""What ROS 2 Humble writes instead of a type hash."""

_WORD: Final = "[A-Za-z][A-Za-z0-9_]{0,254}"
_ROS: Final = re.compile(rf"({_WORD})/({_WORD})/({_WORD})\Z")
_DDS: Final = re.compile(rf"({_WORD})::({_WORD})::dds_::({_WORD})_\Z")


@lru_cache(maxsize=1024)
def write_type(name: str) -> str:
    """Write the type ``package/kind/Name`` as part of a key. Raises WireFormatError."""
    found = _ROS.match(name)
    if found is None:
        raise refuse(name, "the name of a type", "write package/kind/Name, as in std_msgs/msg/String")
    return f"{found[1]}::{found[2]}::dds_::{found[3]}_"


@lru_cache(maxsize=1024)
def parse_type(text: str) -> str:
    """Parse a type written as part of a key. Returns ``package/kind/Name``. Raises WireFormatError."""
    found = _DDS.match(text)
    if found is None:
        raise refuse(text, "a type of ROS in a key", "it would read package::kind::dds_::Name_")
    return f"{found[1]}/{found[2]}/{found[3]}"
