"""Messages as plain data (dicts, lists, numbers, strings) and back: for YAML, JSON and the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from actors.checks import whole_text
from actors.interfaces.errors import MessageTypeError, MessageValueError
from actors.interfaces.fields import FieldType
from actors.interfaces.message import Field, M, Message
from actors.interfaces.naming import closest


def to_plain(message: Message, array: Callable[[FieldType, Any], object] | None = None) -> dict[str, object]:
    """The message as nested dicts in field order; arrays and sequences as lists. Nothing is shared with the message.

    An array of numbers is what `array` makes of its type and its numpy array, if that is given.
    """
    return {
        field.name: _plain(getattr(message, field.name), field.type, array or _listed)
        for field in message.__ros_fields__
    }


def _plain(value: Any, kind: FieldType, array: Callable[[FieldType, Any], object]) -> object:
    if isinstance(value, Message):
        return to_plain(value, array)
    if isinstance(value, tuple):
        return [_plain(item, kind, array) for item in value]  # pyright: ignore[reportUnknownVariableType]
    return array(kind, value) if kind.is_numeric_array else value


def _listed(kind: FieldType, values: Any) -> object:
    return values.tolist()


def from_plain(cls: type[M], mapping: Mapping[str, object] | None) -> M:
    """The message that plain data describes; what it leaves out keeps its default. None is an empty mapping.

    Raises:
        MessageTypeError: an unknown field or a value of the wrong type; names the path, as in `Twist.linear.x`.
        MessageValueError: a value out of range or of the wrong length; names the path.
    """
    return _build(cls, mapping, cls.__name__)


def _build(cls: type[M], mapping: Any, where: str) -> M:
    if isinstance(mapping, cls):
        return mapping
    if mapping is None:
        mapping = {}
    if not isinstance(mapping, Mapping):
        raise MessageTypeError(f"{where}: expected the fields of {cls.__ros_type__}, got {mapping!r}")
    given: Mapping[Any, object] = mapping  # pyright: ignore[reportUnknownVariableType]
    fields = {field.name: field for field in cls.__ros_fields__}
    values: dict[str, object] = {}
    for name, value in given.items():
        field = fields.get(name)
        if field is None:
            names = ", ".join(fields) or "no fields at all"
            hint = closest(str(name), fields)
            raise MessageTypeError(f"{where}: {cls.__ros_type__} has no field {name!r}; it has {names}.{hint}")
        values[field.name] = _value(field, value, f"{where}.{field.name}")
    return cls(**values)


def _value(field: Field, value: object, where: str) -> object:
    from actors.interfaces.check import converter, to_tuple

    kind = field.type
    if kind.is_numeric_array:
        from actors.interfaces.arrays import to_array

        return to_array(where, kind, [] if value is None else value)
    if kind.base == "string" and value is not None:
        value = (
            [_whole(where, each) for each in cast(Sequence[object], value)]
            if isinstance(value, (list, tuple))
            else _whole(where, value)
        )
    if kind.is_array:
        if field.message is not None and isinstance(value, (list, tuple)):
            items = cast(Sequence[object], value)
            value = [_build(field.message, item, f"{where}[{index}]") for index, item in enumerate(items)]
        return to_tuple(where, field, () if value is None else value)
    return _build(field.message, value, where) if field.message is not None else converter(field)(where, value)


def _whole(where: str, value: object) -> object:
    try:
        return whole_text(value) if isinstance(value, str) else value
    except UnicodeDecodeError:
        raise MessageValueError(
            f"{where}: {value!r:.60} holds half of a surrogate pair, which no text of UTF-8 can"
        ) from None
