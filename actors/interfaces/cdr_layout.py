"""Sizes, struct codes and the known position in the stream while code is generated: shared by encoder and decoder.

Classic CDR (XCDR1): every primitive stands at a multiple of its size, counted from the first byte after the header. While
code is generated the exact position is unknown after a string, but often its remainder is known; `Position` keeps that.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import Final, Literal, NamedTuple, TypeAlias

from actors.interfaces.fields import STRINGS
from actors.interfaces.message import Field, Message

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

    def aligned(self, size: int) -> Position:
        """The next multiple of `size`."""
        padding = self.padding(size)
        return Position(size, 0) if padding is None else self.after(padding)

    def meet(self, other: Position) -> Position:
        """The position known when either may be the actual one."""
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


def alignment_of_element(field: Field) -> int:
    """The alignment of the first primitive of an element of a field."""
    if field.type.base in STRINGS:
        return 4
    if field.message is None:
        return SIZES[CODES[field.type.base]]
    first = next(iter(field.message.__ros_fields__), None)
    if first is None:
        return 1
    return 4 if first.type.array in {"bounded", "unbounded"} else alignment_of_element(first)


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


def after_message(cls: type[Message], at: Position) -> Position:
    """The position after a message of this type that begins at `at`."""
    for field in cls.__ros_fields__:
        at = after_field(field, at)
    return at if cls.__ros_fields__ else at.after(EMPTY_SIZE)


@cache
def after_field(field: Field, at: Position) -> Position:
    """The position after a field."""
    kind = field.type
    if not kind.is_array:
        return after_element(field, at)
    if kind.array != "fixed":
        at = at.aligned(4).after(4)
    if not kind.is_numeric_array:
        _, end = loop(field, at)
        return end if kind.array == "fixed" else at.meet(end)
    size = SIZES[CODES[kind.base]]
    # Of no elements not even the alignment is left, so after a sequence no more is known than its count had.
    return at.aligned(size).after(size * kind.size) if kind.array == "fixed" else Position(min(size, 4), 0)


def after_element(field: Field, at: Position) -> Position:
    """The position after one element of a field."""
    if field.message is not None:
        return after_message(field.message, at)
    if field.type.base in STRINGS:
        return UNKNOWN
    size = SIZES[CODES[field.type.base]]
    return at.aligned(size).after(size)


def loop(field: Field, at: Position) -> tuple[Position, Position]:
    """The positions known at the start and at the end of every pass over the elements of a field whose first stands at `at`."""
    start = at.aligned(alignment_of_element(field))
    while True:
        end = after_element(field, start)
        both = start.meet(end)
        if both == start:
            return start, end
        start = both


WStrings: TypeAlias = Literal["zenoh", "cyclone"]
"""`zenoh` (and Fast CDR): number of UTF-16 units, then 4 bytes each. `cyclone`: number of bytes, then 2 bytes a unit."""


def encode_wide(text: str, form: WStrings) -> tuple[int, bytes]:
    """The count that stands before a wide string, and its bytes. There is no NUL at the end."""
    data = text.encode("utf-16-le")
    if form == "cyclone":
        return len(data), data
    count = len(data) // 2
    return count, struct.pack(f"<{count}I", *struct.unpack(f"<{count}H", data))


def wide_size(count: int, form: WStrings) -> int:
    """The number of bytes that a wide string with this count takes."""
    return count if form == "cyclone" else 4 * count


def decode_wide(data: bytes, form: WStrings, order: str) -> str:
    """The text of these bytes in byte order `<` or `>`. What is not UTF-16 becomes U+FFFD, as in other strings."""
    if form != "cyclone":
        count = len(data) // 4
        units = struct.unpack(f"{order}{count}I", data)
        data = struct.pack(f"{order}{count}H", *(unit if unit <= 0xFFFF else 0xFFFD for unit in units))
    return data.decode("utf-16-le" if order == "<" else "utf-16-be", "replace")


class Source:
    """Python source that is generated for one type of message, with what it uses by name (`scope`)."""

    def __init__(self, **scope: object) -> None:
        self.scope = scope
        self.lines: list[str] = []
        self.indent = 1
        self.count = 0

    def line(self, text: str) -> None:
        self.lines.append("    " * self.indent + text)

    def name(self, prefix: str) -> str:
        """A variable of the generated code."""
        self.count += 1
        return f"{prefix}{self.count}"

    def constant(self, prefix: str, value: object) -> str:
        """A name that the generated code has for `value`."""
        name = f"{prefix}{len(self.scope)}"
        self.scope[name] = value
        return name
