"""The checks of a message when it is built: one compiled line for valid values, plain code for the others.

The compiled line of a Vector3 is `if type(self.x) is float and ...: return`. Only when it fails does `settle` walk
through the fields, convert what can be converted without loss (int to float, list to tuple, numpy scalars) and name
what cannot.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from functools import partial
from keyword import iskeyword
from typing import Any

from msgspec.structs import force_setattr

from actors.interfaces.errors import MessageTypeError, MessageValueError
from actors.interfaces.fields import FLOATS, INTEGER_RANGES, STRINGS, FieldType
from actors.interfaces.message import Field

Converter = Callable[[str, Any], object]


def compile_check(name: str, fields: tuple[Field, ...], scope: dict[str, object]) -> Any:
    """The code object of `__post_init__` for these fields; what it refers to is put into `scope`."""
    body: list[str] = []
    conditions: list[str] = []
    narrow: list[str] = []
    for index, field in enumerate(fields):
        value = f"getattr(self, {field.name!r})" if iskeyword(field.name) else f"self.{field.name}"
        if field.type.is_numeric_array:
            body += _array_lines(index, field, name, value, scope)
        elif field.type.is_array:
            body += _tuple_lines(index, field, name, value, scope)
        else:
            conditions.append(_condition(index, field, value, scope))
            if field.type.base == "float32":
                narrow.append(value)
    if narrow:
        layout = struct.Struct(f"<{len(narrow)}f")
        scope["PACK"], scope["UNPACK"] = layout.pack, layout.unpack
        values = ", ".join(narrow)
        conditions.append(f"UNPACK(PACK({values})) == ({values},)")
    scope["SET"] = force_setattr
    scope["SETTLE"] = _settler(name, tuple(field for field in fields if not field.type.is_array))
    lines = ["def __post_init__(self):", *(f"    {line}" for line in body)]
    if conditions:
        lines += ["    try:", f"        if {' and '.join(conditions)}: return"]
        lines += ["    except OverflowError: pass", "    SETTLE(self)"]
    if len(lines) == 1:
        lines.append("    pass")
    holder: dict[str, Any] = {}
    exec(compile("\n".join(lines), f"<check of {name}>", "exec"), scope, holder)
    return holder["__post_init__"].__code__


def _condition(index: int, field: Field, value: str, scope: dict[str, object]) -> str:
    base = field.type.base
    if base in INTEGER_RANGES:
        low, high = INTEGER_RANGES[base]
        return f"type(v := {value}) is int and {low} <= v <= {high}"
    if base in FLOATS:
        return f"type({value}) is float"
    if base == "bool":
        return f"type({value}) is bool"
    if base in STRINGS:
        bound = f" and len(v) <= {field.type.string_bound}" if field.type.string_bound else ""
        return f"type(v := {value}) is str{bound}"
    scope[f"C{index}"] = field.message
    return f"type({value}) is C{index}"


def _array_lines(index: int, field: Field, name: str, value: str, scope: dict[str, object]) -> list[str]:
    from actors.interfaces.arrays import DTYPES, is_settled, to_array

    kind, where = field.type, f"{name}.{field.name}"
    scope["SETTLED"], scope[f"D{index}"] = is_settled, DTYPES[kind.base]
    scope[f"F{index}"] = partial(to_array, where, kind)
    right = {"fixed": f" and len(v) == {kind.size}", "bounded": f" and len(v) <= {kind.size}"}.get(kind.array, "")
    return [f"v = {value}", f"if not (SETTLED(v, D{index}){right}): SET(self, {field.name!r}, F{index}(v))"]


def _tuple_lines(index: int, field: Field, name: str, value: str, scope: dict[str, object]) -> list[str]:
    kind, where = field.type, f"{name}.{field.name}"
    scope[f"K{index}"] = {field.message or str}
    scope[f"F{index}"] = partial(to_tuple, where, field)
    right = {"fixed": f" and len(v) == {kind.size}", "bounded": f" and len(v) <= {kind.size}"}.get(kind.array, "")
    # A bound on the strings is left to the slow way: such fields are rare.
    always = " and not v" if kind.string_bound else f" and {{*map(type, v)}} <= K{index}"
    return [f"v = {value}", f"if not (type(v) is tuple{right}{always}): SET(self, {field.name!r}, F{index}(v))"]


def _settler(name: str, fields: tuple[Field, ...]) -> Callable[[Any], None]:
    steps = [(field.name, f"{name}.{field.name}", converter(field)) for field in fields]

    def settle(message: Any) -> None:
        for attribute, where, convert in steps:
            before = getattr(message, attribute)
            after = convert(where, before)
            if after is not before:
                force_setattr(message, attribute, after)

    return settle


def converter(field: Field) -> Converter:
    """A function `(where, value) -> value` that makes one element right or raises, naming `where`."""
    base = field.type.base
    if base in INTEGER_RANGES:
        return lambda where, value: to_integer(where, base, value)
    if base in FLOATS:
        return lambda where, value: to_float(where, base, value)
    if base == "bool":
        return to_bool
    if base in STRINGS:
        return lambda where, value: to_string(where, field.type, value)
    wanted = field.message
    assert wanted is not None
    return lambda where, value: to_message(where, wanted, value)


def to_bool(where: str, value: object) -> bool:
    """Only a bool is a bool: 0, 1 and "true" are refused, because they usually are another field's value."""
    if type(value) is bool:
        return value
    if _is_scalar(value, "b"):
        return bool(value)
    raise _wrong_type(where, "bool (True or False)", value)


def to_integer(where: str, base: str, value: Any) -> int:
    """A whole number within the range of `base`. Enum members count as their number; bools and floats do not."""
    if base == "byte" and type(value) is bytes and len(value) == 1:
        return value[0]
    if isinstance(value, bool) or not (isinstance(value, int) or _is_scalar(value, "iu")):
        raise _wrong_type(where, base, value)
    number = int(value)
    low, high = INTEGER_RANGES[base]
    if not low <= number <= high:
        raise MessageValueError(f"{where}: {number} is out of range for {base} ({low}..{high})")
    return number


def to_float(where: str, base: str, value: Any) -> float:
    """A float; whole numbers widen. A float32 field keeps the value rounded to float32, as every receiver sees it."""
    if isinstance(value, bool) or not (isinstance(value, (float, int)) or _is_scalar(value, "iuf")):
        raise _wrong_type(where, f"{base} (a float or an int)", value)
    try:
        number = float(value)
        if base == "float64":
            return number
        rounded: float = struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        raise MessageValueError(f"{where}: {value} is out of range for {base}") from None
    return number if rounded == number else rounded


def to_string(where: str, kind: FieldType, value: object) -> str:
    """A plain str within the bound, which counts characters."""
    if not isinstance(value, str):
        raise _wrong_type(where, f"{kind.element} (str)", value)
    text = str.__str__(value)
    if kind.string_bound and len(text) > kind.string_bound:
        raise MessageValueError(
            f"{where}: {kind.element} holds at most {kind.string_bound} characters, got {len(text)}"
        )
    return text


def to_message(where: str, wanted: type[Any], value: object) -> object:
    """A message of exactly this type."""
    if type(value) is not wanted:
        raise _wrong_type(where, wanted.__ros_type__, value)
    return value


def to_tuple(where: str, field: Field, given: object) -> tuple[object, ...]:
    kind = field.type
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise _wrong_type(where, f"{kind} (a list, tuple or other iterable)", given)
    convert = converter(field)
    values: Iterable[object] = given  # pyright: ignore[reportUnknownVariableType]
    items = tuple(convert(f"{where}[{index}]", item) for index, item in enumerate(values))
    if kind.array == "fixed" and len(items) != kind.size:
        raise MessageValueError(f"{where}: {kind} holds exactly {kind.size} elements, got {len(items)}")
    if kind.array == "bounded" and len(items) > kind.size:
        raise MessageValueError(f"{where}: {kind} holds at most {kind.size} elements, got {len(items)}")
    return items


def _is_scalar(value: Any, kinds: str) -> bool:
    """Whether it is a numpy scalar of these kinds. numpy is not imported for that: who has one has imported it."""
    return getattr(value, "ndim", None) == 0 and hasattr(value, "dtype") and value.dtype.kind in kinds


def _wrong_type(where: str, wanted: str, value: object) -> MessageTypeError:
    name = getattr(value, "__ros_type__", None) or type(value).__name__
    text = repr(value)
    return MessageTypeError(f"{where}: expected {wanted}, got {name} {text if len(text) <= 40 else text[:37] + '...'}")
