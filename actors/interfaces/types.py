"""Names to declare message fields with, in plain Python.

    class Pose2D(Message, frozen=True, kw_only=True):
        x: float64 = 0.0
        y: float64 = 0.0
        label: Annotated[string, Chars(10)] = ""                 # string<=10
        path: Many[Point] = default()                            # geometry_msgs/Point[]
        covariance: Annotated[float64_array, Exactly(9)] = default()
        codes: Annotated[int32_array, AtMost(5)] = default([1, 2])

`bool`, `int` (int64), `float` (float64) and `str` (string) may be used as they are. A numeric array is read as a
read-only numpy array and may be given as an array or any sequence of numbers (`uint8_array`, `byte_array` and
`char_array` also as bytes); `Many[...]` is read as a tuple and may be given as any iterable. Type checkers see both:
to them these names are descriptors with one type for reading and a wider one for the constructor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeAlias, TypeVar, overload

import msgspec

from actors.interfaces.fields import FieldType

__all__ = [
    "AtMost",
    "Chars",
    "Exactly",
    "Many",
    "bool_array",
    "byte",
    "byte_array",
    "char",
    "char_array",
    "default",
    "float32",
    "float32_array",
    "float64",
    "float64_array",
    "int8",
    "int8_array",
    "int16",
    "int16_array",
    "int32",
    "int32_array",
    "int64",
    "int64_array",
    "string",
    "string_array",
    "uint8",
    "uint8_array",
    "uint16",
    "uint16_array",
    "uint32",
    "uint32_array",
    "uint64",
    "uint64_array",
    "wstring",
    "wstring_array",
]

byte: TypeAlias = Annotated[int, FieldType("byte")]
char: TypeAlias = Annotated[int, FieldType("char")]
int8: TypeAlias = Annotated[int, FieldType("int8")]
uint8: TypeAlias = Annotated[int, FieldType("uint8")]
int16: TypeAlias = Annotated[int, FieldType("int16")]
uint16: TypeAlias = Annotated[int, FieldType("uint16")]
int32: TypeAlias = Annotated[int, FieldType("int32")]
uint32: TypeAlias = Annotated[int, FieldType("uint32")]
int64: TypeAlias = Annotated[int, FieldType("int64")]
uint64: TypeAlias = Annotated[int, FieldType("uint64")]
float32: TypeAlias = Annotated[float, FieldType("float32")]
float64: TypeAlias = Annotated[float, FieldType("float64")]
string: TypeAlias = Annotated[str, FieldType("string")]
wstring: TypeAlias = Annotated[str, FieldType("wstring")]


class Chars(msgspec.Struct, frozen=True):
    """Bound of a string, in characters: `Annotated[string, Chars(10)]` is `string<=10`."""

    count: int


class Exactly(msgspec.Struct, frozen=True):
    """Length of an array: `Annotated[float64_array, Exactly(9)]` is `float64[9]`."""

    count: int


class AtMost(msgspec.Struct, frozen=True):
    """Bound of an array: `Annotated[int32_array, AtMost(5)]` is `int32[<=5]`."""

    count: int


class DefaultMark:
    """The mark that `default()` leaves until the class is created."""

    __slots__ = ("value",)

    def __init__(self, value: object) -> None:
        self.value = value


def default(value: object = None, /) -> Any:
    """The default of a field: as ROS 2 defines it (zero, empty, the default message), or the elements of an array.

    Defaults are shared: messages never change, so all messages of a class may hold the same default.
    """
    return DefaultMark(value)


T = TypeVar("T")

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Raw: TypeAlias = bytes | bytearray | memoryview

    D = TypeVar("D", bound=np.generic)
    E = TypeVar("E", bound=float)

    class Numbers(Generic[D, E]):
        """How a checker sees a numeric array: read as a numpy array, given as an array or a sequence of numbers."""

        @overload
        def __get__(self, obj: None, owner: type, /) -> Numbers[D, E]: ...
        @overload
        def __get__(self, obj: object, owner: type, /) -> NDArray[D]: ...
        def __get__(self, obj: object, owner: type, /) -> object: ...
        def __set__(self, obj: object, value: NDArray[np.generic] | Sequence[E], /) -> None: ...

    class Octets:
        """How a checker sees an array of octets: as `Numbers`, and given as bytes-like objects too."""

        @overload
        def __get__(self, obj: None, owner: type, /) -> Octets: ...
        @overload
        def __get__(self, obj: object, owner: type, /) -> NDArray[np.uint8]: ...
        def __get__(self, obj: object, owner: type, /) -> object: ...
        def __set__(self, obj: object, value: Raw | NDArray[np.generic] | Sequence[int], /) -> None: ...

    class Many(Generic[T]):
        """How a checker sees a sequence of messages or strings: read as a tuple, given as any iterable."""

        @overload
        def __get__(self, obj: None, owner: type, /) -> Many[T]: ...
        @overload
        def __get__(self, obj: object, owner: type, /) -> tuple[T, ...]: ...
        def __get__(self, obj: object, owner: type, /) -> object: ...
        def __set__(self, obj: object, value: Iterable[T], /) -> None: ...

    bool_array: TypeAlias = Numbers[np.bool_, bool]
    byte_array: TypeAlias = Octets
    char_array: TypeAlias = Octets
    uint8_array: TypeAlias = Octets
    int8_array: TypeAlias = Numbers[np.int8, int]
    int16_array: TypeAlias = Numbers[np.int16, int]
    uint16_array: TypeAlias = Numbers[np.uint16, int]
    int32_array: TypeAlias = Numbers[np.int32, int]
    uint32_array: TypeAlias = Numbers[np.uint32, int]
    int64_array: TypeAlias = Numbers[np.int64, int]
    uint64_array: TypeAlias = Numbers[np.uint64, int]
    float32_array: TypeAlias = Numbers[np.float32, float]
    float64_array: TypeAlias = Numbers[np.float64, float]
    string_array: TypeAlias = Many[str]
    wstring_array: TypeAlias = Many[str]
else:

    class Many:
        """`Many[Point]`, `Many[string]`: a sequence of messages or strings, read as a tuple."""

        def __class_getitem__(cls, element: object) -> object:
            return Annotated[tuple, ManyMark(element)]

    def _array(base: str) -> object:
        return Annotated[object, FieldType(base, array="unbounded")]

    bool_array = _array("bool")
    byte_array = _array("byte")
    char_array = _array("char")
    uint8_array = _array("uint8")
    int8_array = _array("int8")
    int16_array = _array("int16")
    uint16_array = _array("uint16")
    int32_array = _array("int32")
    uint32_array = _array("uint32")
    int64_array = _array("int64")
    uint64_array = _array("uint64")
    float32_array = _array("float32")
    float64_array = _array("float64")
    string_array = _array("string")
    wstring_array = _array("wstring")


class ManyMark:
    """The value of `Many[X]` in an annotation: its element, not resolved yet."""

    __slots__ = ("element",)

    def __init__(self, element: object) -> None:
        self.element = element
