"""Parameter values: the nine types, their inference from Python values, and the values passed between a store and its owner.

Guarantee: the value of a `Parameter` is plain and immutable: `bool`, `int` (64 bits), `float`, `str`, or a tuple of those or of one-byte
`bytes`. Types and their numbers are those of `rcl_interfaces/msg/ParameterType`.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, Final, TypeAlias, cast

import msgspec

Value: TypeAlias = (
    bool
    | int
    | float
    | str
    | tuple[bytes, ...]
    | tuple[bool, ...]
    | tuple[int, ...]
    | tuple[float, ...]
    | tuple[str, ...]
    | None
)
"""A parameter value as it is stored; None means not set."""

INT64_MIN: Final = -(2**63)
INT64_MAX: Final = 2**63 - 1
SEQUENCES: Final = (list, tuple, array)
"""The Python types accepted as arrays."""


class ParameterType(IntEnum):
    """The type of a parameter, numbered as in `rcl_interfaces/msg/ParameterType`."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9

    @property
    def is_array(self) -> bool:
        """True for the five array types."""
        return self >= ParameterType.BYTE_ARRAY

    @classmethod
    def of(cls, value: object) -> ParameterType:
        """The type that ROS 2 infers from a Python value.

        None is NOT_SET. An array is a list, tuple or `array.array` whose elements are all bytes, all bool, all int, all float or all str;
        an empty one counts as BYTE_ARRAY, as in rclpy. Raises TypeError for anything else, including a mixture of int and float.
        """
        known = _TYPE_OF_CLASS.get(type(value))
        if known is not None:
            return known
        if isinstance(value, SEQUENCES):
            return _type_of_elements(cast("Iterable[object]", value))
        for python, kind in _SCALARS:
            if isinstance(value, python):
                return kind
        hint = "call its .tolist() first" if hasattr(value, "tolist") else "use bool, int, float, str or a list of one"
        raise TypeError(f"a parameter cannot hold {value!r} of type {type(value).__name__}; {hint}.")


# bool comes before int because bool is an int in Python.
_SCALARS: Final[tuple[tuple[type, ParameterType], ...]] = (
    (bool, ParameterType.BOOL),
    (int, ParameterType.INTEGER),
    (float, ParameterType.DOUBLE),
    (str, ParameterType.STRING),
)
_TYPE_OF_CLASS: Final[Mapping[type, ParameterType]] = {type(None): ParameterType.NOT_SET, **dict(_SCALARS)}
_CLASS_OF_SCALAR: Final[Mapping[ParameterType, type[Any]]] = {kind: python for python, kind in _SCALARS}
_ARRAYS: Final[tuple[tuple[type, ParameterType], ...]] = (
    (bytes, ParameterType.BYTE_ARRAY),
    (bool, ParameterType.BOOL_ARRAY),
    (int, ParameterType.INTEGER_ARRAY),
    (float, ParameterType.DOUBLE_ARRAY),
    (str, ParameterType.STRING_ARRAY),
)
_CLASS_OF_ELEMENT: Final[Mapping[ParameterType, type]] = {kind: python for python, kind in _ARRAYS}


def _type_of_elements(elements: Iterable[object]) -> ParameterType:
    for python, kind in _ARRAYS:
        if all(isinstance(element, python) for element in elements):
            return kind
    raise TypeError(
        f"a parameter cannot hold the mixed list {elements!r}: all elements must be bytes, bool, int, float or str."
    )


def canonical(value: object, kind: ParameterType) -> Value:
    """Convert `value` (not None) to the form in which it is stored: plain scalars, and tuples for arrays.

    Subclasses (an IntEnum, a numpy.float64) become plain values. Raises ValueError if the value is not of type `kind`, if an integer needs
    more than 64 bits, or if an element of a byte array is not one byte.
    """
    if kind.is_array:
        if isinstance(value, SEQUENCES):
            return cast("Value", _canonical_elements(tuple(cast("Iterable[object]", value)), kind))
    elif kind is not ParameterType.NOT_SET:
        python = _CLASS_OF_SCALAR[kind]
        if isinstance(value, python):
            if kind is ParameterType.INTEGER:
                _check_int64(cast("int", value))
            return cast("Value", value if type(value) is python else python(value))
    raise ValueError(f"type {kind.name} and value {value!r} do not agree; convert the value or give another type.")


def _canonical_elements(elements: tuple[object, ...], kind: ParameterType) -> tuple[object, ...]:
    python = _CLASS_OF_ELEMENT[kind]
    for element in elements:
        if not isinstance(element, python):
            raise ValueError(f"type {kind.name} and element {element!r} do not agree; convert the elements first.")
    if kind is ParameterType.INTEGER_ARRAY:
        for element in elements:
            _check_int64(cast("int", element))
    elif kind is ParameterType.BYTE_ARRAY:
        for element in elements:
            if len(cast("bytes", element)) != 1:
                raise ValueError(f"an element of a BYTE_ARRAY is one byte; {element!r} is not.")
    if all(type(element) is python for element in elements):
        return elements
    return tuple(cast("Any", python)(element) for element in elements)


def _check_int64(value: int) -> None:
    if not INT64_MIN <= value <= INT64_MAX:
        raise ValueError(f"the integer {value} does not fit in 64 bits, which is all a parameter can hold.")


_INFER: Final = cast("ParameterType", None)


class Parameter(msgspec.Struct, frozen=True):
    """A named value, as it is set, stored and reported.

    `Parameter("speed", 0.5)` infers the type and raises TypeError if it cannot. `Parameter("gains", [], DOUBLE_ARRAY)` states the type and
    raises ValueError if the value does not agree. Lists and arrays are stored as tuples. `value` is the plain value; `double_value` and the
    like are typed, and raise TypeError for a parameter of another type.
    """

    name: str
    value: Any = None
    type: ParameterType = _INFER

    def __post_init__(self) -> None:
        value: object = self.value
        kind = cast("object", self.type)
        known = _TYPE_OF_CLASS.get(type(value))
        if known is not None and (kind is None or kind is known):  # a plain scalar needs no conversion and few checks
            if known is ParameterType.INTEGER:
                _check_int64(cast("int", value))
            if kind is None:
                msgspec.structs.force_setattr(self, "type", known)
            return
        if kind is None:
            kind = ParameterType.of(value)
            msgspec.structs.force_setattr(self, "type", kind)
        elif not isinstance(kind, ParameterType):
            raise TypeError(f"the type of parameter {self.name!r} must be a ParameterType, not {kind!r}.")
        msgspec.structs.force_setattr(self, "value", canonical(value, kind))

    @property
    def bool_value(self) -> bool:
        """The value of a BOOL."""
        return cast("bool", self._value_as(ParameterType.BOOL))

    @property
    def integer_value(self) -> int:
        """The value of an INTEGER."""
        return cast("int", self._value_as(ParameterType.INTEGER))

    @property
    def double_value(self) -> float:
        """The value of a DOUBLE."""
        return cast("float", self._value_as(ParameterType.DOUBLE))

    @property
    def string_value(self) -> str:
        """The value of a STRING."""
        return cast("str", self._value_as(ParameterType.STRING))

    @property
    def byte_array_value(self) -> tuple[bytes, ...]:
        """The value of a BYTE_ARRAY."""
        return cast("tuple[bytes, ...]", self._value_as(ParameterType.BYTE_ARRAY))

    @property
    def bool_array_value(self) -> tuple[bool, ...]:
        """The value of a BOOL_ARRAY."""
        return cast("tuple[bool, ...]", self._value_as(ParameterType.BOOL_ARRAY))

    @property
    def integer_array_value(self) -> tuple[int, ...]:
        """The value of an INTEGER_ARRAY."""
        return cast("tuple[int, ...]", self._value_as(ParameterType.INTEGER_ARRAY))

    @property
    def double_array_value(self) -> tuple[float, ...]:
        """The value of a DOUBLE_ARRAY."""
        return cast("tuple[float, ...]", self._value_as(ParameterType.DOUBLE_ARRAY))

    @property
    def string_array_value(self) -> tuple[str, ...]:
        """The value of a STRING_ARRAY."""
        return cast("tuple[str, ...]", self._value_as(ParameterType.STRING_ARRAY))

    def _value_as(self, kind: ParameterType) -> object:
        if self.type is not kind:
            raise TypeError(
                f"parameter {self.name!r} is {self.type.name}, not {kind.name}: its value is {self.value!r}."
            )
        return self.value


def widened(name: str, value: object, kind: ParameterType) -> Parameter:
    """Return `value` as a parameter of type `kind` if that loses nothing, otherwise with its own type.

    An int becomes a float for DOUBLE, a list of numbers becomes floats for DOUBLE_ARRAY, and an empty list becomes any array type. This is
    for values from Python, files and the command line; a value from a ROS service already has an exact type. Raises TypeError and
    ValueError as `Parameter` does.
    """
    if kind is ParameterType.DOUBLE and _is_number(value):
        return Parameter(name, _as_float(value), kind)
    if kind.is_array and isinstance(value, SEQUENCES):
        elements = tuple(cast("Iterable[object]", value))
        if not elements:
            return Parameter(name, (), kind)
        if kind is ParameterType.DOUBLE_ARRAY and all(_is_number(element) for element in elements):
            return Parameter(name, tuple(_as_float(element) for element in elements), kind)
    return Parameter(name, value)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _as_float(value: object) -> float:
    try:
        return float(cast("float", value))
    except OverflowError:
        raise ValueError(f"the integer {value} is too large for a floating-point parameter.") from None


class SetResult(msgspec.Struct, frozen=True):
    """The result of a request to set parameters. If it was refused, `reason` says why; otherwise it is empty."""

    successful: bool = True
    reason: str = ""


class ParameterChange(msgspec.Struct, frozen=True):
    """The effect of one declaration or set: the content of a `rcl_interfaces/msg/ParameterEvent` without stamp and node.

    `new` had no value before, `changed` had one (possibly the same), and `deleted` were removed (their value is None).
    """

    new: tuple[Parameter, ...] = ()
    changed: tuple[Parameter, ...] = ()
    deleted: tuple[Parameter, ...] = ()


class ParameterNames(msgspec.Struct, frozen=True):
    """The result of a listing: the names found and the groups directly above them, each once."""

    names: tuple[str, ...] = ()
    prefixes: tuple[str, ...] = ()
