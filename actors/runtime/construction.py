"""The arguments with which a node object is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actors.errors import DeclarationError


def check_arguments(kind: type[Any], base: type[Any], arguments: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
    """Raise `DeclarationError` unless a class that comes after `base`, which is `Node`, has an ``__init__`` that may take arguments."""
    following = kind.__mro__[kind.__mro__.index(base) + 1 : -1]
    if any("__init__" in vars(each) for each in following):
        return
    name = kind.__name__
    given = ", ".join([*map(repr, arguments), *(f"{key}={value!r}" for key, value in keywords.items())])
    raise DeclarationError(
        f"{name}: a Node is made without arguments, not with ({given:.60}): its name belongs to its place, "
        f"Child({name}, name=...), and what its own __init__ takes comes by Child({name}, args=(...))"
    )
