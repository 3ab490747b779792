"""The definition of a type as text, whatever its origin: for `interface show`, and for bags, which carry the definitions."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, TypeAlias

from actors.interfaces.fields import FieldType
from actors.interfaces.loading import read_file
from actors.interfaces.lookup import class_of, find
from actors.interfaces.message import InterfaceClass, Message, ServiceType
from actors.interfaces.naming import full_name
from actors.interfaces.parse import parse_type
from actors.interfaces.registry import find_definition

Comments: TypeAlias = Literal["top", "all", "none"]
"""Of which definitions the comments are shown: of the type itself, of the types in its fields as well, of none."""

PARTS = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
SEPARATOR = "=" * 80


def definition_text(of: str | InterfaceClass) -> str:
    """The definition as it was written in its file; composed from the fields for a class declared in Python.

    Raises:
        UnknownInterface: no type of that name is known.
    """
    cls = class_of(of)
    if not re.search(r"_[A-Za-z]+$", cls.__ros_type__):  # a part has no file of its own
        written = getattr(cls, "__ros_text__", None)
        if isinstance(written, str):
            return written
        definition = find_definition(cls.__ros_type__)
        if definition is not None:
            return read_file(Path(definition[1]), cls.__ros_type__.partition("/")[0]).text
    return _composed(cls)


def show(of: str | InterfaceClass, *, comments: Comments = "top") -> str:
    """The definition with the fields of nested types below each field, one tab for each level.

    `comments`: of the `top` level only, `all`, or `none` (which drops blank lines as well). Ends with a newline unless empty.

    Raises:
        UnknownInterface: no type of that name is known.
    """
    return "".join(f"{line}\n" for line in _expanded(class_of(of), comments != "none", comments == "all", ""))


def schema_text(of: str | type[Message]) -> str:
    """The definition followed by those of all nested types, as MCAP's `ros2msg` schemas have it."""
    top = class_of(of)
    found: dict[str, InterfaceClass] = {}
    waiting: list[InterfaceClass] = [top]
    while waiting:
        cls = waiting.pop(0)
        if cls.__ros_type__ not in found:
            found[cls.__ros_type__] = cls
            waiting += _nested(cls)
    texts = [f"{SEPARATOR}\nMSG: {FieldType(name).element}\n{definition_text(cls)}" for name, cls in found.items()]
    texts[0] = definition_text(top)
    return "\n".join(text.rstrip("\n") for text in texts) + "\n"


def _nested(cls: InterfaceClass) -> list[InterfaceClass]:
    fields = cls.__ros_fields__ if issubclass(cls, Message) else ()
    return [field.message for field in fields if field.message is not None]


def _expanded(cls: InterfaceClass, comments: bool, nested_comments: bool, indent: str) -> Iterator[str]:
    package = cls.__ros_type__.partition("/")[0]
    for raw in definition_text(cls).splitlines():
        code = raw.partition("#")[0].rstrip()
        line = raw.rstrip() if comments else code
        if line or comments:
            yield f"{indent}{line}" if line else ""
        nested = _nested_type(code, package)
        if nested is not None:
            yield from _expanded(nested, nested_comments, nested_comments, f"{indent}\t")


def _nested_type(code: str, package: str) -> InterfaceClass | None:
    """The message class that a definition line has a field of, if it has one."""
    word, _, rest = code.replace("\t", " ").partition(" ")
    if not rest or "=" in rest:
        return None
    if "_" in word.rpartition("/")[2]:  # a part of a service or action, which only derived types contain
        return find(full_name(word.partition("[")[0], "srv")) or find(full_name(word.partition("[")[0], "action"))
    kind = parse_type(word, package)
    return class_of(kind.base) if kind.is_message else None


def _composed(cls: InterfaceClass) -> str:
    if issubclass(cls, Message):
        lines = [
            f"{constant.type} {constant.name}={_written(constant.value, False)}" for constant in cls.__ros_constants__
        ]
        for field in cls.__ros_fields__:
            default = "" if field.default is None else f" {_written(field.default)}"
            # A '#' or '=' cannot stand in a default: the grammar takes it for a comment or a constant.
            lines.append(f"{field.type} {field.name}{default if not set('#=') & set(default) else ''}")
        return "".join(f"{line}\n" for line in lines)
    parts = PARTS["srv" if issubclass(cls, ServiceType) else "action"]
    return "---\n".join(_composed(getattr(cls, part)) for part in parts)


def _written(value: Any, quoted: bool = True) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and quoted:
        return '"' + value.replace('"', '\\"') + '"'
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_written(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    return str(value)
