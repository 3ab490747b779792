"""Generates the encoder of a message type as Python source: one `struct.pack` for each run of fixed-size fields."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from keyword import iskeyword
from typing import Any

from actors.interfaces.cdr_layout import (
    CODES,
    SIZES,
    START,
    UNKNOWN,
    Position,
    Source,
    WStrings,
    alignment_of_element,
    encode_wide,
    has_loop,
    loop,
)
from actors.interfaces.fields import STRINGS
from actors.interfaces.message import Field, Message

LITTLE_ENDIAN = int.from_bytes(b"\x00\x01\x00\x00", "little")

PADS = [bytes(count) for count in range(8)]
"""Padding of each length."""


def compile_encoder(cls: type[Message], wstrings: WStrings) -> Callable[[Any], bytes]:
    """A function that encodes messages of this type, header included."""
    source = _Encoder(cls, wstrings)
    text = source.text(cls)
    holder: dict[str, Any] = {}
    exec(compile(text, f"<CDR encoder of {cls.__ros_type__}>", "exec"), source.scope, holder)
    encoder: Callable[[Any], bytes] = holder["encode"]
    return encoder


class _Encoder(Source):
    """The source of one encoder. `n` in it is the position in the body, kept up where data decides it."""

    def __init__(self, cls: type[Message], wstrings: WStrings) -> None:
        super().__init__(JOIN=b"".join, PADS=PADS, WIDE=partial(encode_wide, form=wstrings))
        self.at: Position = START
        self.layout: str = "I"
        self.values = [str(LITTLE_ENDIAN)]
        self.size: int = 0  # of the run that is being collected, without the header
        self.listed = has_loop(cls)  # parts go to a list; without loops their number is known, and they are variables
        self.parts: list[str] = []
        self.has_arrays = False

    def text(self, cls: type[Message]) -> str:
        """The whole source."""
        self.line("n = 0")
        if self.listed:
            self.line("parts = []")
            self.line("add = parts.append")
        self.message(cls, "m")
        self.flush()
        few = len(self.parts) < 3 and not self.has_arrays  # they have a sum of their own
        together = " + ".join(self.parts) if few else f"JOIN(({', '.join(self.parts)},))"
        self.line("return JOIN(parts)" if self.listed else f"return {together}")
        if not any("-n &" in line for line in self.lines):  # nothing is aligned by the position
            self.lines = [line for line in self.lines if not line.lstrip().startswith("n ")]
        return "\n".join(["def encode(m):", *self.lines])

    def part(self, expression: str) -> None:
        """Adds bytes to the result."""
        if self.listed:
            self.line(f"add({expression})")
        else:
            self.parts.append(self.name("t"))
            self.line(f"{self.parts[-1]} = {expression}")

    def primitive(self, code: str, value: str) -> None:
        """Adds one primitive to the run that will be packed at once."""
        self.align(SIZES[code])
        self.layout += code
        self.values.append(value)
        self.size += SIZES[code]
        self.at = self.at.after(SIZES[code])

    def align(self, size: int) -> None:
        padding = self.at.padding(size)
        if padding is None:
            self.flush()
            self.line(f"p = -n & {size - 1}")
            self.part("PADS[p]")
            self.line("n += p")
            self.at = Position(size, 0)
        else:
            self.layout += "x" * padding
            self.size += padding
            self.at = self.at.after(padding)

    def flush(self) -> None:
        """Packs the run collected so far."""
        if self.layout:
            pack = self.constant("S", struct.Struct(f"<{self.layout}").pack)
            self.part(f"{pack}({', '.join(self.values)})")
        if self.size:
            self.line(f"n += {self.size}")
        self.layout, self.values, self.size = "", [], 0

    def message(self, cls: type[Message], value: str) -> None:
        """The fields of a message, in line."""
        for field in cls.__ros_fields__:
            attribute = f"getattr({value}, {field.name!r})" if iskeyword(field.name) else f"{value}.{field.name}"
            if field.type.is_array or field.message is not None:
                name = self.name("v")
                self.line(f"{name} = {attribute}")
                attribute = name
            self.field(field, attribute)
        if not cls.__ros_fields__:
            self.primitive("B", "0")

    def field(self, field: Field, value: str) -> None:
        kind = field.type
        if not kind.is_array:
            self.element(field, value)
            return
        if kind.array != "fixed":
            self.primitive("I", f"len({value})")
        if kind.is_numeric_array:
            self.numbers(field, value)
        else:
            self.items(field, value)

    def element(self, field: Field, value: str) -> None:
        if field.message is not None:
            self.message(field.message, value)
        elif field.type.base == "string":
            self.string(value)
        elif field.type.base in STRINGS:
            self.wide_string(value)
        else:
            self.primitive(CODES[field.type.base], value)

    def string(self, value: str) -> None:
        text = self.name("b")
        self.line(f"{text} = ({value} + '\\0').encode()")
        self.primitive("I", f"len({text})")
        self.flush()
        self.part(text)
        self.line(f"n += len({text})")
        self.at = UNKNOWN

    def wide_string(self, value: str) -> None:
        count, text = self.name("c"), self.name("b")
        self.line(f"{count}, {text} = WIDE({value})")
        self.primitive("I", count)
        self.flush()
        self.part(text)
        self.line(f"n += len({text})")
        self.at = UNKNOWN

    def numbers(self, field: Field, value: str) -> None:
        """The elements of a numeric array: its memory as it is."""
        self.has_arrays = True
        size = SIZES[CODES[field.type.base]]
        if field.type.array == "fixed":
            self.align(size)
            self.flush()
            self.part(value)
            self.line(f"n += {size * field.type.size}")
            self.at = self.at.after(size * field.type.size)
            return
        padding = self.at.padding(size)
        self.flush()
        if padding != 0:  # elements are aligned only where there are any
            self.line(f"p = {'-n & 7' if padding is None else padding} if len({value}) else 0")
            self.part("PADS[p]")
            self.line("n += p")
        self.part(value)
        self.line(f"n += {value}.nbytes")
        self.at = Position(min(size, 4), 0)

    def items(self, field: Field, value: str) -> None:
        """The elements of a sequence of strings or messages."""
        self.flush()
        entry = self.at
        alignment = alignment_of_element(field)
        if entry.padding(alignment) != 0:  # aligned once before the loop, often no pass needs to do it
            self.line(f"if {value}:")
            self.indent += 1
            self.align(alignment)
            self.flush()
            self.indent -= 1
        outside = self.count
        item = self.name("e")
        self.at, _ = loop(field, entry)
        self.line(f"for {item} in {value}:")
        self.indent += 1
        self.element(field, item)
        self.flush()
        self.indent -= 1
        self.count = outside  # the variables of the loop are free again
        self.at = self.at if field.type.array == "fixed" else entry.meet(self.at)
