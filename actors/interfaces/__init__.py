"""Message, service and action types: declared in Python, generated from .msg files, or loaded from them at run time.

    from actors.interfaces.geometry_msgs.msg import Twist       # the common ROS packages, fully typed
    load_folder("my_interfaces")                                # your own .msg, .srv and .action files
    class Pose2D(Message, frozen=True, kw_only=True): ...       # or plain Python, see actors.interfaces.types

Whatever their origin, they are encoded (`encode`, `decode`) and hashed (`type_hash`) as ROS 2 does it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.errors import (
    BadDeclaration,
    CdrError,
    InterfaceError,
    MessageTypeError,
    MessageValueError,
    UnknownInterface,
)
from actors.interfaces.fields import ArrayKind, Constant, FieldType
from actors.interfaces.lookup import get_action, get_message, get_service
from actors.interfaces.message import ActionType, Field, InterfaceClass, Message, ServiceType
from actors.interfaces.naming import Kind
from actors.interfaces.registry import add_folder, known_names

if TYPE_CHECKING:
    from actors.interfaces.cdr import Bytes, decode, encode
    from actors.interfaces.cdr_layout import WStrings
    from actors.interfaces.consistency import flaws
    from actors.interfaces.hashes import type_description, type_hash
    from actors.interfaces.loading import load, load_folder
    from actors.interfaces.parse import DefinitionError, ErrorCode
    from actors.interfaces.plain import from_plain, to_plain
    from actors.interfaces.text import Comments, definition_text, schema_text, show

__all__ = [
    "ActionType",
    "ArrayKind",
    "BadDeclaration",
    "Bytes",
    "CdrError",
    "Comments",
    "Constant",
    "DefinitionError",
    "ErrorCode",
    "Field",
    "FieldType",
    "InterfaceClass",
    "InterfaceError",
    "Kind",
    "Message",
    "MessageTypeError",
    "MessageValueError",
    "ServiceType",
    "UnknownInterface",
    "WStrings",
    "add_folder",
    "decode",
    "definition_text",
    "encode",
    "fields_of",
    "flaws",
    "from_plain",
    "get_action",
    "get_message",
    "get_service",
    "known_names",
    "load",
    "load_folder",
    "schema_text",
    "show",
    "to_plain",
    "type_description",
    "type_hash",
    "type_name",
]

_LATE = {
    "Bytes": "cdr",
    "Comments": "text",
    "DefinitionError": "parse",
    "ErrorCode": "parse",
    "WStrings": "cdr_layout",
    "decode": "cdr",
    "definition_text": "text",
    "encode": "cdr",
    "flaws": "consistency",
    "from_plain": "plain",
    "load": "loading",
    "load_folder": "loading",
    "schema_text": "text",
    "show": "text",
    "to_plain": "plain",
    "type_description": "hashes",
    "type_hash": "hashes",
}


def type_name(cls: InterfaceClass) -> str:
    """The full ROS name of a type: `geometry_msgs/msg/Twist`."""
    return cls.__ros_type__


def fields_of(cls: type[Message]) -> tuple[Field, ...]:
    """The fields of a message class, in order."""
    return cls.__ros_fields__


def __getattr__(name: str) -> Any:
    """Imports what is not needed to declare and build messages when it is first used."""
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_LATE[name]}"), name)
