"""The types that data bring along: message classes made from the schemas of a recording, whatever this process knows by the same names.

A schema is the text of a definition, followed by those of all nested types, as rosbag2 writes it (`ros2msg`, `ros2idl`), or of the whole
service for its events.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from actors.interfaces import lookup, registry
from actors.interfaces.errors import InterfaceError
from actors.interfaces.fields import FieldType
from actors.interfaces.hashes import hash_of_definitions, type_hash
from actors.interfaces.idl import as_written, parse_idl
from actors.interfaces.learning import MOST_BYTES
from actors.interfaces.loading import class_body
from actors.interfaces.message import Message, make_message
from actors.interfaces.naming import KINDS, full_name
from actors.interfaces.parse import (
    PARTS,
    SEPARATOR,
    DefinitionError,
    FieldDefinition,
    MessageDefinition,
    parse_recorded,
)

ENCODINGS: Final = ("ros2msg", "ros2idl", "omgidl")
"""The encodings of schemas that are read."""

MOST: Final = 1000
"""How many definitions a schema may hold."""

DEEPEST: Final = 64
"""How deep messages may be nested."""

HEAD: Final = re.compile(r"(MSG|SRV|IDL):\s*(\S+)\s*")


class _Recorded(NamedTuple):
    message: MessageDefinition
    text: str


def ros_name(name: str) -> str:
    """The full name of a type, which others also write as `std_msgs/String` or `std_msgs::msg::String`. Raises `UnknownInterface`."""
    return full_name(name.replace("::", "/"))


def recorded_hash(name: str, encoding: str, text: str) -> str:
    """The type hash of a message by its schema. Raises `InterfaceError` for a schema that cannot be read."""
    name = ros_name(name)
    return _hash(name, _read(name, encoding, text))


def recorded_type(name: str, encoding: str, text: str) -> type[Message]:
    """The message class of a schema.

    It is that of this process if both are the same: if their hashes are equal. A type that this process does not know is known from now
    on, by this definition. What differs from the known one gets a class of its own, which nothing else knows.

    Raises `InterfaceError` for a schema that cannot be read, or names a type that is neither in it nor known.
    """
    name = ros_name(name)
    builder = _Builder(name, _read(name, encoding, text))
    made = builder.type(name)
    for each in builder.made.values():
        if lookup.find(each.__ros_type__) is None:
            registry.register(each)
    return made


class _Builder:
    """Invariant: `made` are the classes made here by their names, in the order in which they need each other."""

    def __init__(self, name: str, definitions: Mapping[str, _Recorded]) -> None:
        self._definitions = definitions
        self._open: list[str] = []
        self.made: dict[str, type[Message]] = {}

    def type(self, name: str) -> type[Message]:
        if name in self.made:
            return self.made[name]
        known = lookup.find(name)
        if name not in self._definitions:
            if known is None or not issubclass(known, Message):
                raise DefinitionError("invalid_type_name", f"{name} is neither in its definition nor known here")
            return known
        if known is not None and type_hash(known) == _hash(name, self._definitions):
            return known
        if name in self._open or len(self._open) > DEEPEST:
            raise DefinitionError("invalid_type_name", f"{name} contains itself, or too many others within each other")
        self._open.append(name)
        message, text = self._definitions[name]
        nested = {field.type.base: self.type(field.type.base) for field in message.fields if field.type.is_message}
        body = class_body(message, nested.__getitem__, None)
        self._open.pop()
        body |= {"__ros_source__": "a recording", "__ros_text__": text, "__ros_detached__": True}
        self.made[name] = made = make_message(name.rpartition("/")[2], body)
        return made


def _hash(name: str, definitions: Mapping[str, _Recorded]) -> str:
    def fields_of(each: str) -> Iterable[tuple[str, FieldType]]:
        if each in definitions:
            return [(field.name, field.type) for field in definitions[each].message.fields]
        known = lookup.find(each)
        if known is None or not issubclass(known, Message):
            raise DefinitionError("invalid_type_name", f"{each} is neither in the definition of {name} nor known here")
        return [(field.name, field.type) for field in known.__ros_fields__]

    return hash_of_definitions(name, fields_of)


def _read(name: str, encoding: str, text: str) -> dict[str, _Recorded]:
    """The definitions of a schema by their full names."""
    if len(text) > MOST_BYTES:
        raise InterfaceError(f"the definition of {name} has {len(text)} characters, more than {MOST_BYTES}")
    sections = list(_sections(name, text))
    if len(sections) > MOST:
        raise InterfaceError(f"the definition of {name} consists of {len(sections)} parts, more than {MOST}")
    found: dict[str, _Recorded] = {}
    if encoding in ("ros2idl", "omgidl"):
        # What a definition needs comes after it in a schema, and before it in IDL.
        parts = parse_idl("\n".join(part for _, _, part in reversed(sections)))
        found = {each.name: _Recorded(each, as_written(each)) for each in parts}
    else:
        for kind, each, part in sections:
            if kind == "IDL":
                found |= {one.name: _Recorded(one, as_written(one)) for one in parse_idl(part)}
            elif kind == "SRV" or (each.endswith("_Event") and SEPARATOR in part.splitlines()):
                parts = parse_recorded(part, each.removesuffix("_Event"), PARTS["srv"])
                found |= {one.name: _Recorded(one, as_written(one)) for one in parts}
            else:
                (message,) = parse_recorded(part, each)
                found.setdefault(each, _Recorded(message, part))
        found = {each: _whole(one, name, found) for each, one in found.items()}
    service = name.removesuffix("_Event")
    if name not in found and f"{service}_Request" in found:
        found[name] = _event(service)
    if name not in found:
        raise InterfaceError(f"the definition of {name} is not in its schema")
    return found


def _sections(name: str, text: str) -> Iterator[tuple[str, str, str]]:
    """The kind, the full name and the text of each definition: that of the type itself, and of the others behind lines of `=`."""
    kind, each, lines = "", name, list[str]()
    waiting = False
    for line in text.splitlines():
        if waiting and (head := HEAD.fullmatch(line.strip())) is not None:
            kind, each = head[1], _full(head[2], name)
            lines, waiting = [], False
        elif len(bare := line.strip()) >= 40 and not bare.strip("="):
            if kind or any(map(str.strip, lines)):
                yield kind, each, "\n".join(lines) + "\n"
            kind, lines, waiting = "", [], True
        else:
            lines.append(line)
    yield kind, each, "\n".join(lines) + "\n"


def _full(name: str, root: str) -> str:
    """The full name of what a schema of `root` calls by this name: parts of services and actions are written without their kind."""
    parts = name.replace("::", "/").split("/")
    package, kind, leaf = root.split("/")
    if len(parts) == 1:
        parts.insert(0, package)
    if len(parts) == 2:
        stem = parts[1].partition("_")
        ours = kind != "msg" and parts[0] == package and stem[0] == leaf.partition("_")[0] and bool(stem[1])
        parts.insert(1, kind if ours else "msg")
    if len(parts) != 3 or parts[1] not in KINDS:
        raise InterfaceError(f"{name!r} in the definition of {root} is not the name of a type")
    return "/".join(parts)


def _whole(recorded: _Recorded, root: str, definitions: Mapping[str, _Recorded]) -> _Recorded:
    """A definition with the full names of what it contains."""
    message = recorded.message
    fields = tuple(field._replace(type=_named(field.type, root, definitions)) for field in message.fields)
    return recorded._replace(message=message._replace(fields=fields))


def _named(kind: FieldType, root: str, definitions: Mapping[str, _Recorded]) -> FieldType:
    if not kind.is_message or kind.base in definitions:
        return kind
    package, given, leaf = kind.base.split("/")
    if given != "msg":
        return kind
    return FieldType(_full(f"{package}/{leaf}", root), array=kind.array, size=kind.size)


def _event(service: str) -> _Recorded:
    """The definition of the events of a service."""
    kinds = {
        "info": FieldType("service_msgs/msg/ServiceEventInfo"),
        "request": FieldType(f"{service}_Request", array="bounded", size=1),
        "response": FieldType(f"{service}_Response", array="bounded", size=1),
    }
    fields = tuple(FieldDefinition(name, kind, None, (), None, 0) for name, kind in kinds.items())
    message = MessageDefinition(f"{service}_Event", fields, (), ())
    return _Recorded(message, as_written(message))
