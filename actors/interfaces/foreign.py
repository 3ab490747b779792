"""The types of endpoints of other processes."""

from __future__ import annotations

from typing import Final

from actors.interfaces.message import InterfaceClass


class ForeignType:
    """The type of an endpoint of another process: its name and its hash. A type of this process is the same if both are equal."""

    def __init__(self, name: str, type_hash: str) -> None:
        self.__ros_type__: Final = name
        """The name, such as ``std_msgs/msg/String``."""
        self.type_hash: Final = type_hash
        """``RIHS01_`` and 64 hexadecimal digits, or what another process gives instead."""

    def __repr__(self) -> str:
        return f"<foreign type {self.__ros_type__}>"


def difference(first: ForeignType | InterfaceClass, second: ForeignType | InterfaceClass) -> tuple[str, str] | None:
    """How each of two types is called when they are told apart: by its name, or by name and hash if the names are equal; None if they are
    the same. Two types of this process are the same if their names are."""
    if first.__ros_type__ != second.__ros_type__:
        return first.__ros_type__, second.__ros_type__
    if isinstance(first, ForeignType) or isinstance(second, ForeignType):
        hashes = _hash_of(first), _hash_of(second)
        if hashes[0] != hashes[1]:
            return f"{first.__ros_type__} ({hashes[0]})", f"{second.__ros_type__} ({hashes[1]})"
    return None


def _hash_of(kind: ForeignType | InterfaceClass) -> str:
    if isinstance(kind, ForeignType):
        return kind.type_hash
    from actors.interfaces.hashes import type_hash

    return type_hash(kind)
