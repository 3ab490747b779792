"""Checks of a handler's annotations against its contract, as far as both can be evaluated without importing anything.

Only contradictions are refused, with `DeclarationError`. An annotation that is missing, cannot be resolved (such as a name imported for
type checkers only) or could be right is left to the type checker.
"""

from __future__ import annotations

import inspect
from collections.abc import AsyncGenerator, AsyncIterable, AsyncIterator, Awaitable, Callable, Coroutine
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin

from actors.contracts.contracts import Aborted, Done
from actors.errors import DeclarationError

_UNKNOWN: Final = object()
"""Stands for an annotation that is missing or cannot be resolved."""


def check_argument(where: str, function: Callable[..., object], verb: str, contract: object, expected: type) -> None:
    """Check that a handler takes self and one message of the contract's type."""
    function = inspect.unwrap(function)
    if function.__code__.co_argcount != 2:
        raise DeclarationError(f"{where} {verb} {contract!r}: it must take self and one {expected.__name__}")
    annotation = _resolved(function, function.__code__.co_varnames[1])
    if _contradicts(annotation, expected):
        raise DeclarationError(
            f"{where} {verb} {contract!r} ({expected.__name__}) but takes {_shown(annotation)}: "
            "change the annotation or the contract"
        )


def check_response(where: str, function: Callable[..., object], contract: object, expected: type) -> None:
    """Check that a service handler is annotated to return the response type."""
    annotation = _returned(function)
    if _contradicts(annotation, expected):
        raise DeclarationError(
            f"{where} serves {contract!r} but returns {_shown(annotation)}: it must return {expected.__name__}; "
            "change the annotation or the contract"
        )


def check_nothing_returned(where: str, function: Callable[..., object], contract: object) -> None:
    """Check that a topic handler is annotated to return nothing: a returned value would be dropped."""
    annotation = _returned(function)
    if not inspect.iscoroutinefunction(function) and get_origin(annotation) in (Coroutine, Awaitable):
        return
    if _contradicts(annotation, NoneType):
        raise DeclarationError(
            f"{where} listens to {contract!r} but returns {_shown(annotation)}: nobody takes that; "
            "annotate it `-> None`, and publish what others shall have"
        )


def check_steps(where: str, function: Callable[..., object], contract: object, feedback: type, result: type) -> None:
    """Check that an action body yields feedback and ends with `Done(result)` or `Aborted(result)`."""
    annotation = _returned(function)
    if annotation is _UNKNOWN:
        return
    remedy = f"annotate it `-> Steps[{feedback.__name__}, {result.__name__}]`"
    if get_origin(annotation) in (AsyncGenerator, AsyncIterator, AsyncIterable):
        for item in _alternatives(get_args(annotation)[0]):
            ends = get_origin(item) in (Done, Aborted)
            part = get_args(item)[0] if ends else item
            if _contradicts(part, result if ends else feedback):
                what = f"end with {_shown(item)}" if ends else f"yield {_shown(item)} as feedback"
                raise DeclarationError(f"{where} serves {contract!r} but says it will {what}: {remedy}")
    elif annotation is None or (
        isinstance(annotation, type) and annotation is not Any and not issubclass(AsyncGenerator, annotation)
    ):
        raise DeclarationError(
            f"{where} serves {contract!r} but says it returns {_shown(annotation)}: it is an async generator; {remedy}"
        )


def _returned(function: Callable[..., object]) -> object:
    """The return annotation; unknown if a decorator of the user wraps the function, since it may change what is returned."""
    return _UNKNOWN if hasattr(function, "__wrapped__") else _resolved(function, "return")


def _resolved(function: Callable[..., object], name: str) -> object:
    annotation = function.__annotations__.get(name, _UNKNOWN)
    if isinstance(annotation, str):
        try:
            return eval(annotation, function.__globals__)
        except Exception:  # a name imported for type checkers only, which will check it
            return _UNKNOWN
    return annotation


def _alternatives(annotation: object) -> tuple[object, ...]:
    return get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)


def _contradicts(annotation: object, expected: type) -> bool:
    """Whether no value of the type `expected` can match `annotation`."""
    if annotation is None:
        return expected is not NoneType
    origin = get_origin(annotation)
    if origin in (Union, UnionType):
        return all(_contradicts(one, expected) for one in get_args(annotation))
    if origin is Annotated:
        return _contradicts(get_args(annotation)[0], expected)
    kind = annotation if origin is None else origin
    if not isinstance(kind, type) or kind is Any:
        return False  # a type variable, an alias of a protocol or a nested string: cannot be decided here
    try:
        return not issubclass(expected, kind)
    except TypeError:  # a protocol that is not checkable at run time
        return False


def _shown(annotation: object) -> str:
    return annotation.__name__ if isinstance(annotation, type) and not get_args(annotation) else str(annotation)
