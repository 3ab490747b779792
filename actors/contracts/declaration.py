"""The base class of declarations, which decorators attach to methods. `Node` collects them when a class is created."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from types import CodeType
from typing import cast

from actors.errors import DeclarationError


class Declaration:
    """A declaration attached to a method by a decorator. `Node` collects it when the class of the method is created."""

    __slots__ = ("attribute", "function")

    def __init__(self) -> None:
        self.function: Callable[..., object]
        self.attribute = ""

    def attach(self, function: Callable[..., object]) -> None:
        if not callable(function):
            raise DeclarationError(f"{self!r} decorates a method, not {function!r}")
        self.function = function
        held = cast("tuple[Declaration, ...]", getattr(function, "__declarations__", ()))
        function.__dict__["__declarations__"] = (*held, self)


def declarations_of(function: object) -> tuple[Declaration, ...]:
    """The declarations attached to a function, innermost decorator first."""
    return cast("tuple[Declaration, ...]", getattr(function, "__declarations__", ()))


def positional(function: Callable[..., object]) -> int:
    """The number of positional arguments of a method, including self."""
    code: CodeType = inspect.unwrap(function).__code__
    return code.co_argcount
