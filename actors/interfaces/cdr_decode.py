"""Generates the decoder of a message type as Python source: one `struct.unpack_from` for each run of fixed-size fields.

Data come from anywhere, so every count is compared with the bytes that are left before anything is allocated for it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from keyword import iskeyword
from typing import Any, NoReturn

from actors.interfaces.cdr_layout import (
    CODES,
    EMPTY_SIZE,
    HEADER,
    SIZES,
    START,
    UNKNOWN,
    Position,
    Source,
    WStrings,
    alignment_of_element,
    decode_wide,
    least_of_element,
    loop,
    wide_size,
)
from actors.interfaces.errors import CdrError
from actors.interfaces.fields import STRINGS
from actors.interfaces.message import Field, Message

Decoder = Callable[[bytes, int], Any]


def compile_decoder(cls: type[Message], wstrings: WStrings, order: str) -> Decoder:
    """A function `(data, len(data)) -> message` for data in byte order `<` or `>`.

    It raises CdrError for a header that does not say this order, and for what is inconsistent; struct.error for data that end too early, and
    InterfaceError for values that the type does not allow.
    """
    source = _Decoder(wstrings, order)
    text = source.text(cls)
    holder: dict[str, Any] = {}
    exec(compile(text, f"<CDR decoder of {cls.__ros_type__}>", "exec"), source.scope, holder)
    decoder: Decoder = holder["decode"]
    return decoder


def _too_long(where: str, count: int, at: int, end: int) -> NoReturn:
    raise CdrError(f"{where}: a length of {count} at byte {at - 4} goes beyond the end of the data ({end} bytes)")


def _other_header(where: str) -> NoReturn:
    raise CdrError(f"{where}: the header is not that of plain CDR in this byte order")


def _over_bound(where: str, count: int, bound: int) -> NoReturn:
    raise CdrError(f"{where}: {count} elements, but at most {bound} are allowed")


class _Decoder(Source):
    """The source of one decoder. `d` are the data, `e` their length, `i` the next byte."""

    def __init__(self, wstrings: WStrings, order: str) -> None:
        self.order = order
        wide = partial(decode_wide, form=wstrings, order=order)
        super().__init__(TOO_LONG=_too_long, OVER_BOUND=_over_bound, OTHER_HEADER=_other_header, WIDE=wide)
        self.wide_factor = wide_size(1, wstrings)
        self.at: Position = START
        # The header is read with the first run.
        self.layout: str = "H2x"
        self.names: list[str] = ["h"]
        self.size: int = HEADER
        self.check = ""
        """What follows the first run."""

    def text(self, cls: type[Message]) -> str:
        """The whole source."""
        self.line("i = 0")
        self.check = f"if h != {0x100 if self.order == '<' else 0}: OTHER_HEADER({cls.__ros_type__!r})"
        result = self.message(cls, cls.__name__)
        self.flush()
        self.line(f"return {result}")
        return "\n".join(["def decode(d, e):", *self.lines])

    def primitive(self, code: str) -> str:
        """Adds one primitive to the run that will be unpacked at once; returns the variable it will be in."""
        self.align(SIZES[code])
        self.names.append(self.name("t"))
        self.skip(code, SIZES[code])
        return self.names[-1]

    def skip(self, code: str, size: int) -> None:
        self.layout += code
        self.size += size
        self.at = self.at.after(size)

    def align(self, size: int) -> None:
        padding = self.at.padding(size)
        if padding is None:
            self.flush()
            # The body begins at byte 4, so what is a multiple of 8 in it is not one in the data.
            self.line(f"i += {'4 - i' if size == 8 else '-i'} & {size - 1}")
            self.at = Position(size, 0)
        elif padding:
            self.skip("x" * padding, padding)

    def flush(self) -> None:
        """Unpacks the run collected so far."""
        if self.names:
            unpack = self.constant("S", struct.Struct(self.order + self.layout).unpack_from)
            self.line(f"{', '.join(self.names)}, = {unpack}(d, i)")
            if self.check:
                self.line(self.check)
                self.check = ""
        if self.size:
            self.line(f"i += {self.size}")
        self.layout, self.names, self.size = "", [], 0

    def message(self, cls: type[Message], where: str) -> str:
        """Reads the fields of a message; returns the expression that builds it from them."""
        plain: list[str] = []
        odd: list[str] = []
        for field in cls.__ros_fields__:
            value = self.field(field, f"{where}.{field.name}")
            if iskeyword(field.name):
                odd.append(f"{field.name!r}: {value}")
            else:
                plain.append(f"{field.name}={value}")
        if not cls.__ros_fields__:
            self.flush()  # some leave the byte out, so what stands before it is read without it
            self.skip("x", EMPTY_SIZE)
            return self.constant("C", cls())  # one for all, however many a sequence claims to hold
        name = self.constant("C", cls)
        if odd:
            plain.append("**{" + ", ".join(odd) + "}")
        return f"{name}({', '.join(plain)})"

    def field(self, field: Field, where: str) -> str:
        kind = field.type
        if not kind.is_array:
            return self.element(field, where)
        count = str(kind.size)
        if kind.array != "fixed":
            count = self.primitive("I")
            self.flush()
            if kind.array == "bounded":
                self.line(f"if {count} > {kind.size}: OVER_BOUND({where!r}, {count}, {kind.size})")
        return self.numbers(field, count, where) if kind.is_numeric_array else self.items(field, count, where)

    def element(self, field: Field, where: str) -> str:
        if field.message is not None:
            return self.message(field.message, where)
        if field.type.base == "string":
            return self.string(where)
        return self.wide_string(where) if field.type.base in STRINGS else self.primitive(CODES[field.type.base])

    def string(self, where: str) -> str:
        count = self.primitive("I")
        self.flush()
        text = self.name("b")
        self.line(f"{text} = ''")
        self.line(f"if {count}:")
        self.line(f"    j = i + {count}")
        self.line(f"    if j > e: TOO_LONG({where!r}, {count}, i, e)")
        # Others have been seen to leave out the NUL, and to send what is not UTF-8; rclpy reads both the same way.
        self.line(f"    {text} = (d[i : j - 1] if d[j - 1] == 0 else d[i:j]).decode('utf-8', 'replace')")
        self.line("    i = j")
        self.at = UNKNOWN
        return text

    def wide_string(self, where: str) -> str:
        count = self.primitive("I")
        self.flush()
        text = self.name("b")
        self.line(f"j = i + {count} * {self.wide_factor}")
        self.line(f"if j > e: TOO_LONG({where!r}, {count}, i, e)")
        self.line(f"{text} = WIDE(d[i:j])")
        self.line("i = j")
        self.at = UNKNOWN
        return text

    def numbers(self, field: Field, count: str, where: str) -> str:
        from actors.interfaces.arrays import reader

        size = SIZES[CODES[field.type.base]]
        fixed = field.type.array == "fixed"
        if fixed:
            self.align(size)
            self.flush()
        elif (padding := self.at.padding(size)) != 0:
            step = "(4 - i & 7)" if padding is None else str(padding)
            self.line(f"if {count}: i += {step}")
        name, read = self.name("a"), self.constant("R", reader(field.type, self.order))
        self.line(f"j = i + {count} * {size}")
        self.line(f"if j > e: TOO_LONG({where!r}, {count}, i, e)")
        self.line(f"{name} = {read}(d, i, j)")
        self.line("i = j")
        self.at = self.at.after(size * field.type.size) if fixed else Position(min(size, 4), 0)
        return name

    def items(self, field: Field, count: str, where: str) -> str:
        self.flush()
        self.line(f"if {count} * {least_of_element(field)} > e - i: TOO_LONG({where!r}, {count}, i, e)")
        entry = self.at
        alignment = alignment_of_element(field)
        if entry.padding(alignment) != 0:
            self.line(f"if {count}:")
            self.indent += 1
            self.align(alignment)
            self.flush()
            self.indent -= 1
        name = self.name("l")
        self.line(f"{name} = []")
        self.at, _ = loop(field, entry)
        outside = self.count
        self.line(f"for _ in range({count}):")
        self.indent += 1
        item = self.element(field, f"{where}[]")
        self.flush()
        self.line(f"{name}.append({item})")
        self.indent -= 1
        self.count = outside  # the variables of the loop are free again: a frame with hundreds of them costs memory
        self.at = self.at if field.type.array == "fixed" else entry.meet(self.at)
        return f"tuple({name})"
