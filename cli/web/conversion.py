"""Messages as JSON and back, as rosbridge has it: arrays of bytes are base64, numbers that JSON lacks are null."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import msgspec

from actors.interfaces import Field, Message, MessageTypeError, MessageValueError, from_plain, to_plain
from actors.interfaces.fields import FLOATS
from cli.web.errors import BadRequest, Refused

if TYPE_CHECKING:
    from actors.interfaces import FieldType
    from actors.interfaces.builtin_interfaces.msg import Time

__all__ = ["BYTES", "message_of", "object_of", "plain", "read_json", "to_json", "write_json"]

M = TypeVar("M", bound=Message)

BYTES: Final = ("uint8", "char", "byte")
"""The numbers whose arrays are bytes."""
HEADER: Final = "std_msgs/msg/Header"


def plain(message: Message) -> dict[str, Any]:
    """The message as nested dicts in the order of its fields. Floats are as they are, also those that JSON lacks."""
    return to_plain(message, _array)


def _array(kind: FieldType, values: Any) -> Any:
    return base64.b64encode(values.tobytes()).decode() if kind.base in BYTES else values.tolist()


def to_json(message: Message) -> bytes:
    """The message as JSON: whole numbers are exact, NaN and infinities are null."""
    return msgspec.json.encode(plain(message))


def write_json(value: Any) -> str:
    """Plain data as JSON text."""
    return msgspec.json.encode(value).decode()


def read_json(text: str | bytes) -> Any:
    """Plain data of a JSON text. NaN and Infinity, which Python writes, are understood. Raises `BadRequest`."""
    try:
        return msgspec.json.decode(text)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        marks = ("NaN", "Infinity") if isinstance(text, str) else (b"NaN", b"Infinity")
        if not any(mark in text for mark in marks):  # type: ignore[operator]
            raise BadRequest(f"no JSON: {error}") from None
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadRequest(f"no JSON: {error}") from None


def object_of(text: str | bytes) -> dict[str, Any]:
    """A JSON object. Raises `BadRequest`."""
    value = read_json(text)
    if not isinstance(value, dict):
        raise BadRequest(f"a JSON object is expected, not {type(value).__name__}")
    return cast("dict[str, Any]", value)


def message_of(kind: type[M], data: Any, stamp: Time | None = None) -> M:
    """The message that plain data describes; what is left out has its default. Raises `Refused`, which names the field.

    With `stamp`, a header without a stamp gets this one.
    """
    if data is not None and not isinstance(data, Mapping):
        raise Refused(f"{kind.__ros_type__}: an object with its fields is expected, not {data!r:.60}")
    given = cast("Mapping[str, Any]", data or {})
    try:
        return from_plain(kind, _read(kind, _stamped(kind, given, stamp)))
    except (MessageTypeError, MessageValueError, RecursionError) as error:
        raise Refused(str(error)) from None


def _stamped(kind: type[Message], given: Mapping[str, Any], stamp: Time | None) -> Mapping[str, Any]:
    if stamp is None or not any(
        field.name == "header" and field.message is not None and field.message.__ros_type__ == HEADER
        for field in kind.__ros_fields__
    ):
        return given
    header: Any = given.get("header") or {}
    if not isinstance(header, dict) or "stamp" in header:
        return given
    return {**given, "header": {**cast("dict[str, Any]", header), "stamp": stamp}}


def _read(kind: type[Message], given: Any) -> Any:
    """Plain data with what JSON cannot say put in: bytes for base64, NaN for null."""
    if not isinstance(given, Mapping):
        return given
    fields = {field.name: field for field in kind.__ros_fields__}
    return {name: _value(fields[name], value) if name in fields else value for name, value in _pairs(given)}


def _items(value: Any) -> Iterable[Any]:
    return cast("Iterable[Any]", value)


def _pairs(value: Any) -> Iterable[tuple[Any, Any]]:
    return cast("Iterable[tuple[Any, Any]]", value.items())


def _value(field: Field, value: Any) -> Any:
    base = field.type.base
    if field.type.is_numeric_array:
        if base in BYTES and isinstance(value, str):
            try:
                return list(base64.b64decode(value, validate=True))
            except (binascii.Error, ValueError) as error:
                raise Refused(f"{field.name}: {field.type} is written in base64: {error}") from None
        if base in BYTES and isinstance(value, bytes):
            return list(value)
        if base in FLOATS and isinstance(value, list):
            return [float("nan") if item is None else item for item in _items(value)]
        return value
    if field.message is not None:
        if field.type.is_array and isinstance(value, list):
            message = field.message
            return [_read(message, item) for item in _items(value)]
        return _read(field.message, value)
    if base in FLOATS and value is None:
        return float("nan")
    return value
