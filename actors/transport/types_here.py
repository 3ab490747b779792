"""Types of this process, as tokens name them."""

from __future__ import annotations

from typing import Any

from actors.interfaces.hashes import type_hash

__all__ = ["described_type", "is_buffer_aware"]


def described_type(cls: Any) -> tuple[str, str]:
    """The name and the hash of a type of this process."""
    return cls.__ros_type__, type_hash(cls)


def is_buffer_aware(cls: Any) -> bool:
    """Whether newer distributions of ROS 2 may send messages of this type on the additional keys of `format.buffers`."""
    return any(field.type.base == "uint8" and field.type.array == "unbounded" for field in cls.__ros_fields__)
