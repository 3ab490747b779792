"""Messages in CBOR (RFC 8949), as rosbridge has them: arrays of numbers are typed arrays (RFC 8746), arrays of bytes are byte strings."""

from __future__ import annotations

from collections.abc import Mapping
from struct import pack
from typing import Any, Final

from actors.interfaces import FieldType, Message, to_plain
from cli.web.clients.conversion import BYTES

_TYPED: Final = {
    "int8": 72, "uint16": 69, "uint32": 70, "uint64": 71, "int16": 77, "int32": 78, "int64": 79, "float32": 85, "float64": 86,
}  # fmt: skip
"""The tags of arrays in little-endian order."""


def cbor_message(message: Message) -> dict[str, Any]:
    """A message as data that `cbor` writes."""
    return to_plain(message, _array)


def _array(kind: FieldType, values: Any) -> Any:
    if kind.base in BYTES:
        return values.tobytes()
    if kind.base in _TYPED:
        return _Tagged(_TYPED[kind.base], values.astype(values.dtype.newbyteorder("<")).tobytes())
    return values.tolist()


def cbor_joined(pairs: Mapping[str, bytes]) -> bytes:
    """A mapping whose values are in CBOR already."""
    return _head(5, len(pairs)) + b"".join(cbor(key) + value for key, value in pairs.items())


class _Tagged:
    """A byte string with a tag."""

    def __init__(self, tag: int, data: bytes) -> None:
        self.tag = tag
        self.data = data


def cbor(value: Any) -> bytes:
    """Plain data as CBOR: None, booleans, numbers, texts, bytes, lists and mappings. Raises TypeError for anything else."""
    parts = bytearray()
    _write(value, parts)
    return bytes(parts)


def _write(value: Any, parts: bytearray) -> None:
    if value is None:
        parts.append(0xF6)
    elif isinstance(value, bool):
        parts.append(0xF5 if value else 0xF4)
    elif isinstance(value, int):
        parts += _head(0, value) if value >= 0 else _head(1, -1 - value)
    elif isinstance(value, float):
        parts += pack(">Bd", 0xFB, value)
    elif isinstance(value, str):
        data = value.encode()
        parts += _head(3, len(data)) + data
    elif isinstance(value, bytes):
        parts += _head(2, len(value)) + value
    elif isinstance(value, _Tagged):
        parts += _head(6, value.tag)
        _write(value.data, parts)
    else:
        _write_many(value, parts)


def _write_many(value: Any, parts: bytearray) -> None:
    if isinstance(value, list):
        items: Any = value  # pyright: ignore[reportUnknownVariableType]
        parts += _head(4, len(items))
        for item in items:
            _write(item, parts)
    elif isinstance(value, Mapping):
        pairs: Any = value  # pyright: ignore[reportUnknownVariableType]
        parts += _head(5, len(pairs))
        for key, item in pairs.items():
            _write(key, parts)
            _write(item, parts)
    else:
        raise TypeError(f"CBOR has no {type(value).__name__}")


def _head(major: int, number: int) -> bytes:
    kind = major << 5
    if number < 24:
        return bytes([kind | number])
    for extra, form, limit in ((24, ">BB", 2**8), (25, ">BH", 2**16), (26, ">BI", 2**32)):
        if number < limit:
            return pack(form, kind | extra, number)
    return pack(">BQ", kind | 27, number)
