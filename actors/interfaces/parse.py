"""Reads .msg, .srv and .action text, by the grammar of ROS 2's own adapter.

    parse("int32 x 3  # metres [m]\\nint32 MAX=9", "my_pkg", "Sample", "msg")

The result says what the text says; which classes the nested types are is decided later (`loading`). Python and C++
keywords are accepted as field names, as ROS 2 does; such a field is read with `getattr`.
"""

from __future__ import annotations

import re
from itertools import pairwise
from textwrap import dedent
from typing import Final, Literal, NamedTuple, TypeAlias

import msgspec

from actors.interfaces.errors import InterfaceError
from actors.interfaces.fields import FLOATS, INTEGER_RANGES, PRIMITIVES, STRINGS, FieldType
from actors.interfaces.naming import Kind, is_constant_name, is_field_name, is_interface_name, is_package_name

ErrorCode: TypeAlias = Literal[
    "invalid_field_definition",
    "invalid_type_name",
    "invalid_type",
    "invalid_member_name",
    "invalid_value",
    "duplicate_name",
    "default_not_supported",
    "invalid_service_spec",
    "invalid_action_spec",
]
"""The sorts of errors in a definition."""

Value: TypeAlias = bool | int | float | str
"""A primitive as plain data."""

PARTS: dict[Kind, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}
SEPARATOR = "---"
_LONGEST_NUMBER: Final = 100
"""Characters of an integer at most; 64 bits need 66, as 0b... ."""


class DefinitionError(InterfaceError, ValueError):
    """A definition that cannot be read. `code` tells the sort of error; the text begins with file and line."""

    def __init__(self, code: ErrorCode, text: str, line: int | None = None, file: str | None = None) -> None:
        self.code: ErrorCode = code
        self.reason = text
        self.line = line
        self.file = file
        place = (f"{file}, " if file else "") + (f"line {line}: " if line else "")
        super().__init__((place if line else place.replace(", ", ": ")) + text)


class FieldDefinition(NamedTuple):
    """One field line: its default as plain data (None: the default of ROS), its comment lines and unit."""

    name: str
    type: FieldType
    default: Value | tuple[Value, ...] | None
    comment: tuple[str, ...]
    unit: str | None
    line: int


class ConstantDefinition(NamedTuple):
    """One constant line."""

    name: str
    type: FieldType
    value: Value
    comment: tuple[str, ...]
    unit: str | None
    line: int


class MessageDefinition(NamedTuple):
    """A message, or one part of a service or action. `name` is full: `std_srvs/srv/SetBool_Request`."""

    name: str
    fields: tuple[FieldDefinition, ...]
    constants: tuple[ConstantDefinition, ...]
    comment: tuple[str, ...]


class Definition(NamedTuple):
    """A whole file: one message, the two parts of a service, or the three of an action; and its text, as a .msg, .srv or .action file has it."""

    name: str
    parts: tuple[MessageDefinition, ...]
    text: str
    file: str | None = None


def parse(text: str, package: str, name: str, kind: Kind, file: str | None = None) -> Definition:
    """Reads a definition of any kind. `file` is only for errors.

    Raises:
        DefinitionError: with file, line and reason.
    """
    if not is_package_name(package):
        raise DefinitionError(
            "invalid_type_name", f"{package!r:.200} is not a package name ({_LOWER_RULE})", None, file
        )
    if not is_interface_name(name):
        raise DefinitionError(
            "invalid_type_name", f"{name!r:.200} is not a name for a type ({_CAMEL_RULE})", None, file
        )
    parts: list[MessageDefinition] = []
    for suffix, (offset, lines) in zip(PARTS[kind], _split(text, kind, file), strict=True):
        parts.append(_parse_part(lines, package, f"{package}/{kind}/{name}{suffix}", offset, file))
    return Definition(f"{package}/{kind}/{name}", tuple(parts), text, file)


def parse_recorded(text: str, name: str, parts: tuple[str, ...] = ("",)) -> tuple[MessageDefinition, ...]:
    """Reads a definition that came with data: of the message `name`, or of the parts of a service or action of this name.

    What others have named in their own way is taken as it is: a type `ESF_Status`, a field `frameId`, `std_msgs/msg/Header` as a type.

    Raises:
        DefinitionError: with line and reason.
    """
    package, kind, _ = name.split("/")
    lines = text.splitlines()
    split = [(0, lines)] if parts == ("",) else _split(text, "srv" if kind == "srv" else "action", None)
    return tuple(
        _parse_part(part, package, f"{name}{suffix}", offset, None, strict=False)
        for suffix, (offset, part) in zip(parts, split, strict=True)
    )


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""What is taken for a name in a definition that came with data."""

_LOWER_RULE = "lower-case letters, digits and single inner underscores, a letter first"
_CAMEL_RULE = "letters and digits, an upper-case letter first"


def _split(text: str, kind: Kind, file: str | None) -> list[tuple[int, list[str]]]:
    """The lines of each part with the number of lines before it."""
    lines = text.splitlines()
    if kind == "msg":
        return [(0, lines)]
    marks = [index for index, line in enumerate(lines) if line == SEPARATOR]
    wanted = len(PARTS[kind]) - 1
    if len(marks) != wanted:
        code: ErrorCode = "invalid_service_spec" if kind == "srv" else "invalid_action_spec"
        what = "a .srv file has one line '---' between request and response"
        if kind == "action":
            what = "an .action file has two lines '---': goal, result, feedback"
        line = marks[wanted] + 1 if len(marks) > wanted else max(len(lines), 1)
        raise DefinitionError(
            code, f"{what}; found {len(marks)} (exactly three dashes, no blanks after them)", line, file
        )
    edges = [-1, *marks, len(lines)]
    return [(start + 1, lines[start + 1 : end]) for start, end in pairwise(edges)]


def _parse_part(
    lines: list[str], package: str, name: str, offset: int, file: str | None, *, strict: bool = True
) -> MessageDefinition:
    fields: list[FieldDefinition] = []
    constants: list[ConstantDefinition] = []
    comments: list[list[str]] = []  # of each element, in step with `elements`
    elements: list[FieldDefinition | ConstantDefinition] = []
    names: set[tuple[bool, str]] = set()
    start = next((index for index, line in enumerate(lines) if not line.startswith("#")), len(lines))
    waiting: list[str] = []
    for number, raw in enumerate(lines[start:], offset + start + 1):
        code, mark, remark = raw.replace("\t", " ").rstrip().partition("#")
        if mark and code and not code.strip():  # an indented comment continues what stands above it
            if elements:
                comments[-1].append(_bare(remark))
            continue
        if mark:
            waiting.append(_bare(remark))
        code = code.rstrip()
        if not code:
            continue
        try:
            element = _parse_line(code, package, number, strict)
        except DefinitionError as error:
            raise DefinitionError(error.code, f"{error.reason} in {code!r:.300}", number, file) from None
        name_of_kind = isinstance(element, FieldDefinition), element.name
        if name_of_kind in names:
            raise DefinitionError("duplicate_name", f"{element.name!r:.200} is there twice", number, file)
        names.add(name_of_kind)
        elements.append(element)
        comments.append(waiting)
        waiting = []
    for element, remarks in zip(elements, comments, strict=True):
        comment, unit = _unit(_condense(remarks))
        if isinstance(element, FieldDefinition):
            fields.append(element._replace(comment=comment, unit=unit))
        else:
            constants.append(element._replace(comment=comment, unit=unit))
    file_comment = _condense([_bare(line.lstrip("#")) for line in lines[:start]])
    return MessageDefinition(name, tuple(fields), tuple(constants), tuple(file_comment))


def _bare(remark: str) -> str:
    return remark.lstrip("#").rstrip()


def _parse_line(code: str, package: str, number: int, strict: bool) -> FieldDefinition | ConstantDefinition:
    type_text, _, rest = code.partition(" ")
    rest = rest.lstrip()
    if not rest:
        raise DefinitionError(
            "invalid_field_definition", "a line is 'TYPE NAME [DEFAULT]' or 'TYPE NAME=VALUE'; one is missing"
        )
    name, equals, value = rest.partition("=")
    if equals:
        name, value = name.rstrip(), value.lstrip()
        if type_text not in PRIMITIVES:
            raise DefinitionError(
                "invalid_type", f"a constant cannot be of type {type_text!r:.200}, only a plain primitive"
            )
        if not (is_constant_name(name) if strict else _NAME.fullmatch(name)):
            raise DefinitionError(
                "invalid_member_name", f"{name!r:.200} is not a name for a constant (upper case; '=' makes a constant)"
            )
        kind = FieldType(type_text)
        return ConstantDefinition(name, kind, _parse_primitive(kind, value), (), None, number)
    kind = parse_type(type_text, package, strict=strict)
    name, _, default = rest.partition(" ")
    if not (is_field_name(name) if strict else _NAME.fullmatch(name)):
        raise DefinitionError("invalid_member_name", f"{name!r:.200} is not a name for a field ({_LOWER_RULE})")
    default = default.lstrip()
    return FieldDefinition(name, kind, parse_value(kind, default) if default else None, (), None, number)


def parse_type(text: str, package: str | None, *, strict: bool = True) -> FieldType:
    """`string<=10[<=5]`, `float64[9]`, `geometry_msgs/Point[]`, or `Point` where a package is given. If it is not `strict`, a type may have
    any name, also a full one: `geometry_msgs/msg/Point`.

    Raises:
        DefinitionError: with code `invalid_type` or `invalid_type_name`.
    """
    array: Literal["single", "fixed", "bounded", "unbounded"] = "single"
    size = 0
    if text.endswith("]"):
        element, bracket, inner = text[:-1].rpartition("[")
        if not bracket:
            raise DefinitionError("invalid_type", f"type {text!r:.200} ends with ']' but has no '['")
        array = "unbounded"
        if inner:
            array = "bounded" if inner.startswith("<=") else "fixed"
            size = _positive(inner.removeprefix("<="), f"array type {text!r:.200}")
        text = element
    base, bound = text, 0
    for name in sorted(STRINGS):
        if text.startswith(f"{name}<="):
            base, bound = name, _positive(text[len(name) + 2 :], f"string type {text!r:.200}")
    if base not in PRIMITIVES and base not in {"time", "duration"}:
        base = _message_name(base, package) if strict else _recorded_name(base, package)
    return FieldType(base, bound, array, size)


def _positive(text: str, what: str) -> int:
    try:
        number = int(text) if len(text) <= _LONGEST_NUMBER else 0
    except ValueError:
        number = 0
    if number <= 0:
        raise DefinitionError("invalid_type", f"{what}: {text!r:.200} is not a positive number")
    return number


def _message_name(text: str, package: str | None) -> str:
    parts = text.split("/")
    if len(parts) == 1 and package is not None:
        parts.insert(0, package)
    if len(parts) != 2 or not is_package_name(parts[0]) or not is_interface_name(parts[1]):
        raise DefinitionError("invalid_type_name", f"{text!r:.200} is neither a primitive type nor 'package/Name'")
    return f"{parts[0]}/msg/{parts[1]}"


def _recorded_name(text: str, package: str | None) -> str:
    parts = text.split("/")
    if len(parts) == 1 and package is not None:
        parts.insert(0, package)
    if len(parts) == 2:
        parts.insert(1, "msg")
    if len(parts) != 3 or not all(_NAME.fullmatch(part) for part in parts):
        raise DefinitionError("invalid_type_name", f"{text!r:.200} is neither a primitive type nor 'package/Name'")
    return "/".join(parts)


def parse_value(kind: FieldType, text: str) -> Value | tuple[Value, ...]:
    """The default or constant `text` as plain data; a tuple for arrays.

    Raises:
        DefinitionError: with code `invalid_value` or `default_not_supported`.
    """
    if kind.base not in PRIMITIVES:
        raise DefinitionError("default_not_supported", f"a field of type {kind} cannot have a default")
    if not kind.is_array:
        return _parse_primitive(kind, text)
    if not (text.startswith("[") and text.endswith("]") and len(text) > 1):
        raise DefinitionError(
            "invalid_value", f"the default of {kind} is written in brackets, as [1, 2], not {text!r:.200}"
        )
    inner = text[1:-1]
    items = _string_items(inner) if kind.base in STRINGS else inner.split(",") if inner else []
    if (kind.array == "fixed" and len(items) != kind.size) or (kind.array == "bounded" and len(items) > kind.size):
        raise DefinitionError("invalid_value", f"{len(items)} values do not fit {kind}")
    element = msgspec.structs.replace(kind, array="single", size=0)
    return tuple(_parse_primitive(element, item.strip()) for item in items)


def _parse_primitive(kind: FieldType, text: str) -> Value:
    if kind.base == "bool":
        value = {"true": True, "1": True, "false": False, "0": False}.get(text.lower())
        if value is None:
            raise DefinitionError("invalid_value", f"{text!r:.200} is not a bool (true, false, 1 or 0)")
        return value
    if kind.base in STRINGS:
        return _parse_string(kind, text)
    try:
        if kind.base in FLOATS:
            return float(text)
        number = _integer(text)
    except ValueError:
        raise DefinitionError("invalid_value", f"{text!r:.200} is not a value of {kind.base}") from None
    low, high = INTEGER_RANGES[kind.base]
    if not low <= number <= high:
        raise DefinitionError("invalid_value", f"{number} is out of range for {kind.base} ({low}..{high})")
    return number


def _integer(text: str) -> int:
    if len(text) > _LONGEST_NUMBER:
        raise ValueError
    try:
        return int(text)
    except ValueError:
        return int(text, 0)


def _parse_string(kind: FieldType, text: str) -> str:
    for quote in "\"'":
        if text.startswith(quote) and text.endswith(quote):
            text = text[1:-1]
            if re.search(rf"(?<!\\){quote}", text):
                raise DefinitionError("invalid_value", f"a {quote} inside the string needs a backslash before it")
            text = text.replace("\\" + quote, quote)
            break
    if kind.string_bound and len(text) > kind.string_bound:
        raise DefinitionError("invalid_value", f"{text!r:.200} is longer than {kind.string_bound} characters")
    return text


_QUOTED: Final = {quote: re.compile(rf"{quote}(?:\\.|[^\\{quote}])*+{quote}") for quote in "\"'"}


def _string_items(text: str) -> list[str]:
    """The elements of a list of strings: quoted ones may contain commas, bare ones end at the next comma."""
    items: list[str] = []
    at = _after_blanks(text, 0)
    while at < len(text):
        if text[at] == ",":
            raise DefinitionError("invalid_value", f"an element is missing before {text[at:]!r:.200}")
        if text[at] in _QUOTED:
            found = _QUOTED[text[at]].match(text, at)
            if found is None:
                raise DefinitionError("invalid_value", f"the quote that opens {text[at:]!r:.200} is not closed")
            items.append(found[0])
            at = _after_blanks(text, found.end())
        else:
            end = text.find(",", at)
            end = len(text) if end < 0 else end
            items.append(text[at:end])
            at = end
        if at < len(text) and text[at] != ",":
            raise DefinitionError("invalid_value", f"expected a comma before {text[at:]!r:.200}")
        at = _after_blanks(text, at + 1)
    return items


def _after_blanks(text: str, at: int) -> int:
    """The index of the first character from `at` on that is no blank; the end if there is none."""
    while at < len(text) and text[at] == " ":
        at += 1
    return at


def _condense(lines: list[str]) -> list[str]:
    """Comment lines without common indentation, without empty lines at both ends and without two in a row."""
    kept: list[str] = []
    for line in lines:
        if line or (kept and kept[-1]):
            kept.append(line)
    while kept and not kept[-1]:
        kept.pop()
    return dedent("\n".join(kept)).split("\n") if kept else []


_UNIT = re.compile(r"\[([^,\[\]]+)\]")


def _unit(lines: list[str]) -> tuple[tuple[str, ...], str | None]:
    """A single `[text]` without a comma in a comment is the unit, and no longer part of the comment."""
    found = _UNIT.findall("\n".join(lines))
    if len(found) != 1:
        return tuple(lines), None
    lines = [line.replace(f"[{found[0]}]", "").rstrip() for line in lines]
    return tuple(_condense(lines)), str(found[0]).strip()
