"""Types of this process, as transports know them."""

from __future__ import annotations

from typing import Any, Final

from actors.interfaces.hashes import type_hash
from actors.transport.protocol import TypeInfo

_BYTES: Final = ("uint8", "int8", "byte", "char")


def type_info(cls: Any) -> TypeInfo:
    """What a transport must know of a type of this process."""
    fields = getattr(cls, "__ros_fields__", ())  # a service has none
    unbounded = {field.type.base for field in fields if field.type.array == "unbounded"}
    return TypeInfo(cls.__ros_type__, type_hash(cls), any(each in unbounded for each in _BYTES), "uint8" in unbounded)
