"""Type descriptions and their RIHS01 hashes, by which ROS 2 machines recognize that they mean the same type.

The hash is SHA-256 over one canonical JSON text: the fields of the type, in order, and those of all types it contains.
Defaults, constants and comments do not count. Source: REP 2011 and `rosidl_generator_type_description`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import cache
from hashlib import sha256
from typing import Any, Final, TypeAlias

from actors.interfaces.derived import event_message, feedback_message, get_result_service, send_goal_service
from actors.interfaces.fields import PLACEHOLDER, FieldType
from actors.interfaces.lookup import class_of
from actors.interfaces.message import Field, InterfaceClass, Message, ServiceType

TYPE_IDS: Final = {
    "int8": 2,
    "uint8": 3,
    "char": 3,  # ROS 2 turns the char of a .msg into a uint8 before it hashes
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
NESTED: Final = 1
BOUNDED_STRING: Final = 4
"""Added to the type id of `string` or `wstring` if it is bounded."""
ARRAY_OFFSETS: Final = {"single": 0, "fixed": 48, "bounded": 96, "unbounded": 144}


def type_hash(of: str | InterfaceClass) -> str:
    """`RIHS01_` and 64 hex digits, for a message, service or action given as a class or by its ROS name.

    Raises:
        UnknownInterface: no type of that name is known.
    """
    cls: object = class_of(of)
    return _hash(cls)


@cache
def _hash(cls: Any) -> str:
    return _digest(type_description(cls))


def _digest(description: dict[str, object]) -> str:
    text = json.dumps(description)  # json's own separators, ASCII escapes and key order are the canonical ones
    return f"RIHS01_{sha256(text.encode()).hexdigest()}"


def hash_of_definitions(name: str, fields_of: Callable[[str], Iterable[tuple[str, FieldType]]]) -> str:
    """The hash of a message of which there are only definitions: `fields_of` gives the fields of each by its full name, in order."""
    found: dict[str, dict[str, object]] = {}
    waiting = [name]
    while waiting:
        each = waiting.pop()
        if each not in found:
            fields = list(fields_of(each))
            found[each] = _individual(each, [(field, kind, None) for field, kind in fields])
            waiting += [kind.base for _, kind in fields if kind.is_message]
    description = found.pop(name)
    return _digest(
        {"type_description": description, "referenced_type_descriptions": [found[each] for each in sorted(found)]}
    )


def type_description(of: str | InterfaceClass) -> dict[str, Any]:
    """The canonical description as plain data, in the shape of `type_description_interfaces/msg/TypeDescription`."""
    top = class_of(of)
    found: dict[str, dict[str, object]] = {}
    waiting: list[InterfaceClass] = [top]
    while waiting:
        cls = waiting.pop()
        if cls.__ros_type__ in found:
            continue
        fields = list(_fields(cls))
        found[cls.__ros_type__] = _individual(cls.__ros_type__, fields)
        waiting += [nested for _, _, nested in fields if nested is not None]
    description = found.pop(top.__ros_type__)
    return {"type_description": description, "referenced_type_descriptions": [found[name] for name in sorted(found)]}


_FieldEntry: TypeAlias = tuple[str, FieldType, InterfaceClass | None]


def _individual(name: str, fields: Iterable[_FieldEntry]) -> dict[str, object]:
    entries = [{"name": field, "type": _field_type(kind)} for field, kind, _ in fields]
    if not entries:
        dummy = FieldType("uint8")  # C structs cannot be empty, so upstream puts this member into an empty type
        entries = [{"name": PLACEHOLDER, "type": _field_type(dummy)}]
    return {"type_name": name, "fields": entries}


def _field_type(kind: FieldType) -> dict[str, object]:
    number = NESTED if kind.is_message else TYPE_IDS[kind.base] + (BOUNDED_STRING if kind.string_bound else 0)
    array, size = kind.array, kind.size
    if kind.base == "wstring" and kind.string_bound and array == "unbounded":
        array, size = (
            "bounded",
            kind.string_bound,
        )  # a slip of rosidl_parser, which every distribution has in its hashes
    return {
        "type_id": number + ARRAY_OFFSETS[array],
        "capacity": size,
        "string_capacity": kind.string_bound,
        "nested_type_name": kind.base if kind.is_message else "",
    }


def _fields(cls: InterfaceClass) -> Iterable[_FieldEntry]:
    if issubclass(cls, Message):
        return [_entry(field) for field in cls.__ros_fields__]
    parts: Any = cls
    if issubclass(cls, ServiceType):
        members = {
            "request_message": parts.Request,
            "response_message": parts.Response,
            "event_message": event_message(parts),
        }
    else:
        members = {
            "goal": parts.Goal,
            "result": parts.Result,
            "feedback": parts.Feedback,
            "send_goal_service": send_goal_service(parts),
            "get_result_service": get_result_service(parts),
            "feedback_message": feedback_message(parts),
        }
    return [(name, FieldType(member.__ros_type__), member) for name, member in members.items()]


def _entry(field: Field) -> _FieldEntry:
    return field.name, field.type, field.message
