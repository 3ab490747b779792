"""Numeric sequences as numpy arrays that never change. Imported when a message with such a field is first built."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from actors.interfaces.errors import MessageTypeError, MessageValueError
from actors.interfaces.fields import FLOATS, INTEGER_RANGES, FieldType

ndarray = np.ndarray
Array: TypeAlias = NDArray[Any]
DType: TypeAlias = np.dtype[Any]

DTYPES: Final[dict[str, DType]] = {
    "bool": np.dtype(np.bool_),
    "byte": np.dtype(np.uint8),
    "char": np.dtype(np.uint8),
    **{name: np.dtype(name) for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")},
    "float32": np.dtype(np.float32),
    "float64": np.dtype(np.float64),
}
CONTIGUOUS: Final = 0x1
CONTIGUOUS_WRITEABLE: Final = 0x401
"""Bits of `ndarray.flags.num`; asking for them at once costs half of asking for each by name."""
OCTETS: Final = frozenset({"byte", "char", "uint8"})


LARGE: Final = 1 << 20
"""From so many bytes on numpy copies faster into its own memory than into bytes."""


def is_settled(value: object, dtype: DType) -> bool:
    """Whether `value` can be kept as it is: flat, of this dtype, and a view of memory that nobody can write to through it.

    An array that owns its memory is not: a reader of the message could make it writeable, or resize it.
    """
    return (
        type(value) is ndarray
        and value.dtype is dtype
        and value.ndim == 1
        and value.flags.num & CONTIGUOUS_WRITEABLE == CONTIGUOUS
        and (isinstance(base := value.base, bytes) or (base is not None and _cannot_change(base)))
    )


def _cannot_change(base: object) -> bool:
    if type(base) is bytes:
        return True
    if type(base) is ndarray:
        return not base.flags.writeable and (base.base is None or _cannot_change(base.base))
    return False


def frozen(values: Array) -> Array:
    """A view of `values`, which nobody else holds, for a message: it refuses to be written to, made writeable or resized.

    numpy has no way to refuse an assignment to `shape`, `dtype` or `strides`.
    """
    values.setflags(write=False)
    return values.view()


def _kept(value: Array, dtype: DType) -> Array:
    """A flat array of the right dtype as a message keeps it: the same memory if that is read-only, else a copy."""
    if not value.flags.writeable and value.flags.contiguous and (value.base is None or _cannot_change(value.base)):
        return value.view()
    return np.frombuffer(value.tobytes(), dtype) if value.nbytes < LARGE else frozen(value.copy())


def to_array(where: str, kind: FieldType, given: object) -> Array:
    """`given` as a read-only, one-dimensional array of the field's dtype: a view of memory that nobody can write to through it.

    Accepts arrays (copied unless they and their base are read-only; who makes its own array read-only promises that nobody writes to it
    through a view made before), bytes-like objects for octets, and any iterable of
    numbers. Whole numbers widen to floats and floats round to float32; nothing is ever truncated or wrapped.

    Raises:
        MessageTypeError: something that is not numbers of the right sort; the text names the field and the element.
        MessageValueError: a number out of range, or a wrong length.
    """
    dtype = DTYPES[kind.base]
    value: Any = given  # a name that type checkers do not narrow to half-known types
    if type(given) is ndarray and value.dtype is dtype and value.ndim == 1:  # by far the most frequent
        result = value if is_settled(value, dtype) else _kept(value, dtype)
    elif isinstance(given, ndarray):
        result = _from_array(where, kind, value, dtype)
    elif isinstance(given, (bytes, bytearray, memoryview)) and kind.base in OCTETS:
        result = np.frombuffer(bytes(value), dtype)
    elif isinstance(given, (array, memoryview)):
        result = _from_array(where, kind, np.asarray(value), dtype)
    elif isinstance(given, (str, bytes, bytearray)) or not isinstance(given, Iterable):
        raise MessageTypeError(f"{where}: expected {kind} (a numpy array or a sequence), got {_shown(value)}")
    else:
        result = _from_items(where, kind, list(value), dtype)
    _check_length(where, kind, len(result))
    return result


def _check_length(where: str, kind: FieldType, length: int) -> None:
    if kind.array == "fixed" and length != kind.size:
        raise MessageValueError(f"{where}: {kind} holds exactly {kind.size} elements, got {length}")
    if kind.array == "bounded" and length > kind.size:
        raise MessageValueError(f"{where}: {kind} holds at most {kind.size} elements, got {length}")


def _from_array(where: str, kind: FieldType, value: Array, dtype: DType) -> Array:
    if value.ndim != 1:
        if kind.base not in OCTETS or value.dtype != dtype:
            raise MessageTypeError(
                f"{where}: {kind} is one-dimensional, got an array of shape {value.shape}; use .ravel()"
            )
        value = value.reshape(-1)  # an image: rows one after the other, as on the wire
    if value.dtype == dtype:
        return frozen(np.array(value, dtype=dtype))
    if value.dtype.kind == "O":
        return _from_items(where, kind, value.tolist(), dtype)
    allowed = {"bool": "b"}.get(kind.base, "iuf" if kind.base in FLOATS else "iu")
    if value.dtype.kind not in allowed:
        raise MessageTypeError(f"{where}: an array of {value.dtype} does not fit {kind} without loss")
    if kind.base in INTEGER_RANGES:
        if value.size:
            _check_range(where, kind, int(value.min()), int(value.max()), value)
        return frozen(value.astype(dtype))
    return _as_floats(where, kind, value, dtype)


def _from_items(where: str, kind: FieldType, items: list[Any], dtype: DType) -> Array:
    accepted = _accepted(kind.base)
    kinds: set[type[object]] = {type(item) for item in items}
    for wrong in kinds:
        if not issubclass(wrong, accepted) or (wrong is bool and kind.base != "bool"):
            index = next(i for i, item in enumerate(items) if type(item) is wrong)
            raise MessageTypeError(f"{where}[{index}]: expected {kind.base}, got {_shown(items[index])}")
    if kind.base in INTEGER_RANGES:
        if items:
            _check_range(where, kind, min(items), max(items), items)
        return frozen(np.array(items, dtype))
    if kind.base == "bool":
        return frozen(np.array(items, dtype))
    try:
        return _as_floats(where, kind, np.array(items, np.float64), dtype)
    except OverflowError as error:
        raise MessageValueError(f"{where}: a whole number in it is too large for {kind.base}") from error


def _accepted(base: str) -> tuple[type, ...]:
    if base == "bool":
        return (bool, np.bool_)
    return (int, np.integer) if base in INTEGER_RANGES else (float, int, np.floating, np.integer)


def _check_range(where: str, kind: FieldType, low: int, high: int, values: Iterable[Any]) -> None:
    smallest, largest = INTEGER_RANGES[kind.base]
    if low < smallest or high > largest:
        index, value = next((i, int(v)) for i, v in enumerate(values) if not smallest <= int(v) <= largest)
        raise MessageValueError(f"{where}[{index}]: {value} is out of range for {kind.base} ({smallest}..{largest})")


def _as_floats(where: str, kind: FieldType, value: Array, dtype: DType) -> Array:
    with np.errstate(over="ignore"):
        result = value.astype(dtype)
    lost = np.isinf(result) & np.isfinite(value)
    if lost.any():
        index = int(np.argmax(lost))
        raise MessageValueError(f"{where}[{index}]: {value[index]} is out of range for {kind.base}")
    return frozen(result)


def _shown(value: object) -> str:
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= 40 else text[:37] + '...'}"


def shown(values: Array) -> str:
    """An array in the `repr` of a message: all of a short one, both ends of a long one."""
    if len(values) <= 16:
        return f"array({values.tolist()}, dtype={values.dtype})"
    ends = ", ".join(map(str, values[:3].tolist())), ", ".join(map(str, values[-3:].tolist()))
    return f"array([{ends[0]}, ..., {ends[1]}], dtype={values.dtype}, size={len(values)})"


def reader(kind: FieldType, order: str) -> Callable[[bytes, int, int], Array]:
    """A function `(data, start, stop) -> array` for the elements of a field on the wire, in byte order `<` or `>`.

    Arrays of 8-byte numbers are copies, since they would not be aligned in the data; the others are views of the data.
    """
    dtype = DTYPES[kind.base]
    size = dtype.itemsize
    frombuffer = np.frombuffer
    swapped = dtype.newbyteorder(">")
    empty = frozen(np.empty(0, dtype))  # shared: most sequences of most messages are empty

    def read(data: bytes, start: int, stop: int) -> Array:
        return frombuffer(data, dtype, (stop - start) // size, start) if stop > start else empty

    def read_copy(data: bytes, start: int, stop: int) -> Array:
        return frombuffer(data[start:stop], dtype) if stop > start else empty

    def read_swapped(data: bytes, start: int, stop: int) -> Array:
        return frozen(frombuffer(data[start:stop], swapped).astype(dtype))

    def read_bools(data: bytes, start: int, stop: int) -> Array:
        return frozen(frombuffer(data[start:stop], np.uint8) != 0)

    if kind.base == "bool":
        return read_bools
    if order == ">" and size > 1:
        return read_swapped
    return read_copy if size == 8 else read
