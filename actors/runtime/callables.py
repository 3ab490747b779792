"""Questions about the functions that a node is given as handlers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any, cast


def is_async(handler: object) -> bool:
    """Whether a call of `handler` makes a coroutine, as far as it can be told; partials, callable objects and wrappers are looked into."""
    while isinstance(handler, partial):
        handler = cast("Any", handler).func
    if not (inspect.isroutine(handler) or isinstance(handler, type)):
        handler = getattr(handler, "__call__", None)  # noqa: B004  # an object that can be called
    handler = inspect.unwrap(handler) if callable(handler) else None
    if inspect.iscoroutinefunction(handler):
        return True
    returned = str(getattr(handler, "__annotations__", {}).get("return", ""))
    return any(word in returned for word in ("Coroutine", "Awaitable"))


def name_of(handler: object) -> str:
    """A handler's name in reports. It is the same in every incarnation, because waiting messages are kept by it."""
    function = handler.func if isinstance(handler, partial) else handler  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
    return str(getattr(function, "__qualname__", type(function).__name__))  # pyright: ignore[reportUnknownArgumentType]


def takes_argument(callback: Callable[..., object]) -> bool:
    """Whether a callback must be given an argument. One that does not show what it takes is given none."""
    try:
        parameters = inspect.signature(callback).parameters.values()
    except ValueError:
        return False
    return any(one.kind in _POSITIONAL and one.default is one.empty for one in parameters)


_POSITIONAL = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
