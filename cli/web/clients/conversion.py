"""Messages as JSON and back, as rosbridge has it: arrays of bytes are base64, numbers that JSON lacks are null."""

from __future__ import annotations

import asyncio
import base64
import binascii
import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import msgspec

from actors.interfaces import (
    Field,
    FieldType,
    Message,
    MessageTypeError,
    MessageValueError,
    decode,
    from_plain,
    to_plain,
)
from actors.interfaces.fields import FLOATS
from cli.web.clients.errors import BadRequest, Refused

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg import Time

M = TypeVar("M", bound=Message)
T = TypeVar("T")

BYTES: Final = ("uint8", "char", "byte")
"""The numbers whose arrays are bytes."""
HEADER: Final = "std_msgs/msg/Header"
TIME: Final = "builtin_interfaces/msg/Time"
DURATION: Final = "builtin_interfaces/msg/Duration"
OF_ROS_1: Final = {"secs": "sec", "nsecs": "nanosec"}
LIGHT: Final = 32 * 1024
"""Bytes or characters that are read at once; more take a thread, or the loop would stand still for longer than 5 ms."""
MANY: Final = 2000
"""Values of a message, likewise."""
MOST_OBJECTS: Final = 100_000
"""Objects of one JSON text. One of 4 MB could have a million, which take seconds and hundreds of megabytes."""


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
    if (objects := text.count("{" if isinstance(text, str) else b"{")) > MOST_OBJECTS:  # type: ignore[arg-type]
        raise BadRequest(f"{objects} objects in one text: at most {MOST_OBJECTS}; a message of more is sent in CDR")
    value = read_json(text)
    if not isinstance(value, dict):
        raise BadRequest(f"a JSON object is expected, not {type(value).__name__}")
    return cast("dict[str, Any]", value)


def message_of(kind: type[M], data: Any, stamp: Time | None = None) -> M:
    """The message that plain data describes; what is left out has its default. Raises `Refused`, which names the field.

    With `stamp`, a header without a stamp gets this one, and so does a time that is "now". Times and durations may have ROS 1's names.
    """
    if data is not None and not isinstance(data, Mapping):
        raise Refused(f"{kind.__ros_type__}: an object with its fields is expected, not {data!r:.60}")
    given = cast("Mapping[str, Any]", data or {})
    try:
        return from_plain(kind, _read(kind, _stamped(kind, given, stamp), stamp))
    except (MessageTypeError, MessageValueError, RecursionError) as error:
        raise Refused(str(error)) from None


class Conversions:
    """Reads what clients send. What is large is read in a thread, one at a time, so that all other clients are served meanwhile."""

    def __init__(self) -> None:
        self._one = asyncio.Lock()

    async def object(self, text: str | bytes) -> dict[str, Any]:
        """See `object_of`."""
        return await self._done(len(text) > LIGHT, object_of, text)

    async def message(self, kind: type[M], data: Any, stamp: Time | None = None) -> M:
        """See `message_of`."""
        return await self._done(_many(data), message_of, kind, data, stamp)

    async def cdr(self, kind: type[M], payload: bytes) -> M:
        """See `actors.interfaces.decode`."""
        return await self._done(len(payload) > LIGHT, decode, kind, payload)

    async def _done(self, large: bool, work: Callable[..., T], *arguments: Any) -> T:
        if not large:
            return work(*arguments)
        async with self._one:
            return await asyncio.to_thread(work, *arguments)


def _many(data: Any) -> bool:
    """Whether plain data has more than `MANY` values, or texts of more than `LIGHT` characters."""
    values = characters = 0
    waiting: list[Any] = [data]
    while waiting:
        value = waiting.pop()
        if isinstance(value, str):
            characters += len(value)
        elif isinstance(value, (list, Mapping)):
            inner: Any = value  # pyright: ignore[reportUnknownVariableType]
            values += len(inner)
            if values <= MANY:
                waiting += inner.values() if isinstance(inner, Mapping) else inner
        if values > MANY or characters > LIGHT:
            return True
    return False


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


def _read(kind: type[Message], given: Any, stamp: Time | None) -> Any:
    """Plain data with what JSON cannot say put in: bytes for base64, NaN for null, the time for "now"."""
    if stamp is not None and given == "now" and kind.__ros_type__ == TIME:
        return stamp
    if not isinstance(given, Mapping):
        return given
    fields = {field.name: field for field in kind.__ros_fields__}
    pairs = _pairs(given)
    if kind.__ros_type__ in (TIME, DURATION):
        pairs = ((OF_ROS_1.get(name, name), value) for name, value in pairs)
    return {name: _value(fields[name], value, stamp) if name in fields else value for name, value in pairs}


def _items(value: Any) -> Iterable[Any]:
    return cast("Iterable[Any]", value)


def _pairs(value: Any) -> Iterable[tuple[Any, Any]]:
    return cast("Iterable[tuple[Any, Any]]", value.items())


def _value(field: Field, value: Any, stamp: Time | None) -> Any:
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
            return [_read(message, item, stamp) for item in _items(value)]
        return _read(field.message, value, stamp)
    if base in FLOATS and value is None:
        return float("nan")
    return value
