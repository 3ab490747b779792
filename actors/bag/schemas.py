"""The types of a bag: as it defines them, which are those of this process wherever both are the same."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Final

from actors.bag.contents import BagError, BagTopic
from actors.interfaces.cdr import decode
from actors.interfaces.errors import CdrError, InterfaceError
from actors.interfaces.hashes import type_hash
from actors.interfaces.lookup import find, get_message
from actors.interfaces.message import Message
from actors.interfaces.schemas import ENCODINGS, recorded_hash, recorded_type, ros_name

HASH: Final = re.compile(r"RIHS01_[0-9a-f]{64}")

EMPTY: Final = 8
"""The bytes of a message without fields at most: the header of CDR, and the field that ROS 2 puts in, with padding."""

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


def decoder_of(topic: BagTopic, type: type[Message]) -> Callable[[bytes], Message]:
    """What decodes the messages of a topic, whose type this is. It raises `CdrError`, also for data where the bag tells of no fields."""
    if type.__ros_fields__ or topic.schema.strip():
        return partial(decode, type)

    def without_fields(data: bytes) -> Message:
        if len(data) > EMPTY:
            raise CdrError(f"the bag's definition of {topic.type} is empty, and a message has {len(data)} bytes")
        return decode(type, data)

    return without_fields


@lru_cache(maxsize=256)
def _type(name: str, encoding: str, schema: str, hashed: str) -> type[Message]:
    if encoding in ENCODINGS and (schema.strip() or _without_fields(name, encoding, schema, hashed)):
        return recorded_type(name, encoding, schema)
    known = get_message(ros_name(name))
    if HASH.fullmatch(hashed) and hashed != type_hash(known):
        raise InterfaceError(
            f"{name} was recorded with another definition ({hashed}) than is known here ({type_hash(known)}), which the bag does not hold"
        )
    return known


def _without_fields(name: str, encoding: str, schema: str, hashed: str) -> bool:
    """Whether an empty definition is that of a type without fields, and not one that the writer did not have."""
    if HASH.fullmatch(hashed):
        return hashed == recorded_hash(name, encoding, schema)
    return find(ros_name(name)) is None
