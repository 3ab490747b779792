"""Recorded messages as this process has their types: where the definitions differ, field by field, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from actors.bag.contents import BagError, BagTopic
from actors.bag.schemas import decoder_of, type_of
from actors.interfaces.cdr import decode
from actors.interfaces.fields import FLOATS, INTEGER_RANGES, STRINGS
from actors.interfaces.lookup import get_message
from actors.interfaces.message import Field, Message
from actors.interfaces.schemas import ros_name

KINDS: Final = {
    **dict.fromkeys(INTEGER_RANGES, "number"),
    **dict.fromkeys(FLOATS, "number"),
    **dict.fromkeys(STRINGS, "text"),
}


class Here(NamedTuple):
    """How messages of a topic become those of this process."""

    type: type[Message]
    decode: Callable[[bytes], Message]
    """Raises `InterfaceError` for a message that cannot be decoded, or does not fit the type here."""

    left_out: tuple[str, ...] = ()
    """The recorded fields that the type here does not have."""

    defaults: tuple[str, ...] = ()
    """The fields of the type here that were not recorded."""


def here(topic: BagTopic) -> Here:
    """How messages of a topic become those of this process.

    Raises `BagError` as `type_of` does, and if the recorded definition and the one here have no field in common.
    """
    recorded = type_of(topic)
    known = get_message(ros_name(topic.type)) if recorded.__ros_fields__ or topic.schema else recorded
    if known is recorded:
        return Here(known, decoder_of(topic, recorded))
    left_out, defaults = list[str](), list[str]()
    convert = _converter(recorded, known, "", left_out, defaults)
    if convert is None:
        raise BagError(
            f"{topic.name} was recorded with another definition of {topic.type}, which has no field in common with the one here"
        )

    def converted(data: bytes) -> Message:
        return convert(decode(recorded, data))

    return Here(known, converted, tuple(left_out), tuple(defaults))


def _converter(
    recorded: type[Message], known: type[Message], within: str, left_out: list[str], defaults: list[str]
) -> Callable[[Any], Message] | None:
    """What makes a message of one type from one of the other; None if they have nothing in common."""
    theirs = {field.name: field for field in recorded.__ros_fields__}
    steps: list[tuple[str, Callable[[Any], object]]] = []
    for field in known.__ros_fields__:
        other = theirs.get(field.name)
        step = None if other is None else _step(other, field, f"{within}{field.name}.", left_out, defaults)
        if step is None:
            defaults.append(f"{within}{field.name}")
        else:
            del theirs[field.name]
            steps.append((field.name, step))
    left_out += [f"{within}{name}" for name in theirs]
    if not steps:
        return None

    def convert(message: object) -> Message:
        return known(**{name: step(getattr(message, name)) for name, step in steps})

    return convert


def _step(
    other: Field, field: Field, within: str, left_out: list[str], defaults: list[str]
) -> Callable[[Any], object] | None:
    """What makes the value of one field from that of another; None if their types do not agree."""
    if other.type.is_array != field.type.is_array:
        return None
    if other.message is field.message:
        agree = other.type.base == field.type.base or KINDS.get(other.type.base, 0) == KINDS.get(field.type.base, 1)
        lossy = other.type.base in FLOATS and field.type.base not in FLOATS
        return _same if agree and not lossy else None
    if other.message is None or field.message is None:
        return None
    convert = _converter(other.message, field.message, within, left_out, defaults)
    if convert is None or not field.type.is_array:
        return convert
    return lambda values: tuple(map(convert, values))


def _same(value: object) -> object:
    return value
