"""What encoder and decoder share: sizes, struct codes, and what is known of the position while code is generated.

Classic CDR (XCDR1): every primitive stands at a multiple of its size, counted from the first byte after the header. While
code is generated the exact position is unknown after a string, but often its remainder is known; `Position` keeps that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeVar

from actors.interfaces.fields import STRINGS, Field
from actors.interfaces.message import Message

HEADER: Final = 4
"""Length of the encapsulation header: 00 01 00 00 for little endian, 00 00 00 00 for big endian."""

CODES: Final = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
SIZES: Final = {"?": 1, "B": 1, "b": 1, "h": 2, "H": 2, "i": 4, "I": 4, "q": 8, "Q": 8, "f": 4, "d": 8}
EMPTY_SIZE: Final = 1
"""A type without fields travels as one zero byte, the dummy member upstream gives it."""

T = TypeVar("T")


class Position(NamedTuple):
    """The position in the body is known to be `remainder` modulo `modulus` (a power of two up to 8)."""

    modulus: int
    remainder: int

    def padding(self, size: int) -> int | None:
        """The bytes to skip to a multiple of `size`, None where it depends on the data."""
        return -self.remainder % size if self.modulus >= size else None

    def after(self, count: int) -> Position:
        """The position `count` bytes on."""
        return Position(self.modulus, (self.remainder + count) % self.modulus)

    def meet(self, other: Position) -> Position:
        """What is known when it may be either."""
        modulus = min(self.modulus, other.modulus)
        while (self.remainder - other.remainder) % modulus:
            modulus //= 2
        return Position(modulus, self.remainder % modulus)


START: Final = Position(8, 0)
UNKNOWN: Final = Position(1, 0)


def has_loop(cls: type[Message]) -> bool:
    """Whether encoding a message of this type walks through a sequence of messages or strings."""
    return any(
        (field.type.is_array and not field.type.is_numeric_array)
        or (field.message is not None and has_loop(field.message))
        for field in cls.__ros_fields__
    )


def first_alignment(cls: type[Message]) -> int:
    """The alignment of the first primitive of a message of this type."""
    if not cls.__ros_fields__:
        return 1
    first = cls.__ros_fields__[0]
    if first.type.base in STRINGS or first.type.array in {"bounded", "unbounded"}:
        return 4
    return first_alignment(first.message) if first.message is not None else SIZES[CODES[first.type.base]]


def least_size(cls: type[Message]) -> int:
    """The least number of bytes that a message of this type takes, padding aside."""
    return sum(map(_least_of_field, cls.__ros_fields__)) or EMPTY_SIZE


def _least_of_field(field: Field) -> int:
    if field.type.array in {"bounded", "unbounded"}:
        return 4
    return least_of_element(field) * (field.type.size or 1)


def least_of_element(field: Field) -> int:
    """The least number of bytes that one element of a field takes."""
    if field.message is not None:
        return least_size(field.message)
    return 4 if field.type.base in STRINGS else SIZES[CODES[field.type.base]]


def stable_start(start: Position, body: Callable[[Position], Position]) -> tuple[Position, Position]:
    """Generates the body of a loop until its start is right for the first pass and for all others.

    `body` (re)generates the code for a start and returns its end. Returns both.
    """
    while True:
        end = body(start)
        both = start.meet(end)
        if both == start:
            return start, end
        start = both
