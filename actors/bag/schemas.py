"""The types of a bag: those of this process where it knows them, and else made from the definitions in the bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.bag.contents import BagError, BagTopic
from actors.interfaces.errors import InterfaceError
from actors.interfaces.learning import define, read
from actors.interfaces.naming import full_name
from actors.interfaces.registry import find, get_message

if TYPE_CHECKING:
    from actors.interfaces.message import Message

__all__ = ["type_of"]

SEPARATOR: Final = "=" * 80
HEAD: Final = "MSG: "


def type_of(topic: BagTopic) -> type[Message]:
    """The type of a topic's messages. What this process does not know is defined from now on, as the bag has it.

    Raises `BagError` if the bag holds no definition, or one that cannot be read.
    """
    try:
        if find(full_name(topic.type)) is None:
            _define(topic)
        return get_message(topic.type)
    except InterfaceError as error:
        raise BagError(f"{topic.name}: {error}") from error


def _define(topic: BagTopic) -> None:
    if topic.schema_encoding != "ros2msg" or not topic.schema:
        return  # the search for the type tells what is missing
    texts: dict[str, str] = {}
    first, *others = topic.schema.split(f"{SEPARATOR}\n")
    for other in others:
        head, _, text = other.partition("\n")
        texts[full_name(head.removeprefix(HEAD).strip())] = text
    define(read(texts | {full_name(topic.type): first}))
