"""The types of a bag: as it defines them, which are those of this process wherever both are the same."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from actors.bag.contents import BagError, BagTopic
from actors.interfaces.errors import InterfaceError
from actors.interfaces.hashes import type_hash
from actors.interfaces.registry import get_message
from actors.interfaces.schemas import ENCODINGS, recorded_hash, recorded_type, ros_name

if TYPE_CHECKING:
    from actors.interfaces.message import Message

__all__ = ["identity", "type_of"]

HASH: Final = re.compile(r"RIHS01_[0-9a-f]{64}")

REMEDIES: Final = {
    "ros1": ": those are messages of ROS 1; convert its bag by `rosbags-convert` (pip install rosbags)",
    "json": ": read it by the tools of MCAP, such as `mcap cat --json`",
    "protobuf": ": read it by the tools of MCAP, such as `mcap cat --json`",
}
"""What to do with messages that are not in CDR, by their encoding."""


def type_of(topic: BagTopic) -> type[Message]:
    """The type of a topic's messages, as the bag defines it.

    It is that of this process if the bag has the same definition, or none. A type that this process does not know is known from now on, by
    the bag's definition; one that differs from what is known by its name is a class of its own.

    Raises `BagError` for messages that are not in CDR, and if the bag holds no definition, or one that cannot be read, or only the hash of
    another definition than that of this process.
    """
    if topic.serialization_format != "cdr":
        remedy = REMEDIES.get(topic.serialization_format, "")
        raise BagError(
            f"{topic.name} is recorded in {topic.serialization_format!r}, and only CDR can be decoded{remedy}"
        )
    try:
        return _type(topic.type, topic.schema_encoding, topic.schema, topic.type_hash)
    except InterfaceError as error:
        raise BagError(f"{topic.name}: {error}") from error


def identity(topic: BagTopic) -> str:
    """What tells topics of one name and type apart if they have different definitions; empty if the bag has none."""
    try:
        return (
            recorded_hash(topic.type, topic.schema_encoding, topic.schema)
            if topic.schema_encoding in ENCODINGS
            else topic.schema
        )
    except InterfaceError:
        return topic.schema


@lru_cache(maxsize=256)
def _type(name: str, encoding: str, schema: str, hashed: str) -> type[Message]:
    if encoding in ENCODINGS:
        return recorded_type(name, encoding, schema)
    known = get_message(ros_name(name))
    if HASH.fullmatch(hashed) and hashed != type_hash(known):
        raise InterfaceError(
            f"{name} was recorded with another definition ({hashed}) than is known here ({type_hash(known)}), which the bag does not hold"
        )
    return known
