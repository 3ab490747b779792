"""Types of this process, as tokens name them."""

from __future__ import annotations

from typing import Any, Final

from actors.interfaces.hashes import type_hash

__all__ = ["described_type", "is_buffer_aware", "is_bulk"]

_BYTES: Final = ("uint8", "int8", "byte", "char")


def described_type(cls: Any) -> tuple[str, str]:
    """The name and the hash of a type of this process."""
    return cls.__ros_type__, type_hash(cls)


def is_buffer_aware(cls: Any) -> bool:
    """Whether newer distributions of ROS 2 may send messages of this type on the additional keys of `format.buffers`."""
    return any(field.type.base == "uint8" and field.type.array == "unbounded" for field in cls.__ros_fields__)


def is_bulk(cls: Any) -> bool:
    """Whether messages of this type are as large as what they contain: an image, a cloud of points, a map."""
    return any(field.type.base in _BYTES and field.type.array == "unbounded" for field in cls.__ros_fields__)
