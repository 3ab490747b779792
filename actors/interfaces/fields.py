"""The types that a field can have, and the constants of a message, as plain values."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

import msgspec

ArrayKind: TypeAlias = Literal["single", "fixed", "bounded", "unbounded"]
"""No array; of a given size; of at most a given size; of any size."""

INTEGER_RANGES: Final[dict[str, tuple[int, int]]] = {
    "byte": (0, 255),
    "char": (0, 255),
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}
"""Smallest and largest value of each integer type; `byte` and `char` are octets, as ROS 2 treats them."""

FLOATS: Final = frozenset({"float32", "float64"})
STRINGS: Final = frozenset({"string", "wstring"})
NUMERIC: Final = frozenset({"bool", *INTEGER_RANGES, *FLOATS})
"""Types whose sequences are numpy arrays."""
PRIMITIVES: Final = NUMERIC | STRINGS

PLACEHOLDER: Final = "structure_needs_at_least_one_member"
"""The field that ROS 2 puts into an empty type."""


class FieldType(msgspec.Struct, frozen=True):
    """The type of one field, as a .msg file spells it.

    `base` is a primitive name or the full name of a message (`geometry_msgs/msg/Point`). `string_bound` and `size` are
    0 where there is no bound. `str()` gives the .msg spelling: `string<=10[<=5]`, `geometry_msgs/Point[2]`.
    """

    base: str
    string_bound: int = 0
    array: ArrayKind = "single"
    size: int = 0

    @property
    def is_array(self) -> bool:
        """Whether the field holds many values (fixed, bounded or unbounded)."""
        return self.array != "single"

    @property
    def is_numeric_array(self) -> bool:
        """Whether the field is a numpy array."""
        return self.array != "single" and self.base in NUMERIC

    @property
    def is_message(self) -> bool:
        """Whether one element is a message."""
        return "/" in self.base

    @property
    def element(self) -> str:
        """The spelling of one element: `string<=10`, `geometry_msgs/Point`, `float64`."""
        if self.is_message:
            package, _, rest = self.base.partition("/")
            return f"{package}/{rest.rpartition('/')[2]}"
        return f"{self.base}<={self.string_bound}" if self.string_bound else self.base

    def __str__(self) -> str:
        if self.array == "single":
            return self.element
        if self.array == "fixed":
            return f"{self.element}[{self.size}]"
        return f"{self.element}[<={self.size}]" if self.array == "bounded" else f"{self.element}[]"


class Constant(msgspec.Struct, frozen=True):
    """A named constant of a message: a class attribute in Python, `TYPE NAME=VALUE` in a .msg file."""

    name: str
    type: FieldType
    value: bool | int | float | str

    def __str__(self) -> str:
        return f"{self.type} {self.name}={self.value}"
