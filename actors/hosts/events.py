"""What a process on another machine tells its tree, read without executing any of it.

It is a pickle, as processes of one machine exchange them. Of what it names only the values that a process tells are made; everything else,
such as what the fields of a log line hold, becomes an object that shows its name and does nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection
from functools import cache, lru_cache, partial
from types import UnionType
from typing import Any, Final, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from msgspec import Struct

from actors.errors import RemoteError
from actors.logs.levels import Level
from actors.pickle_bounds import BoundedUnpickler, Steps, check_extent, new_error
from actors.processes import messages
from actors.runtime.node import Node
from actors.supervision import reasons
from actors.supervision.child import Child
from actors.supervision.policy import Backoff
from actors.supervision.refs import ChildRef
from actors.supervision.report import Report

T = TypeVar("T")

_EVENTS: Final = (messages.Ready, messages.Over, messages.Line, messages.Told, messages.Nodes)
STEPS: Final = 1_000_000
"""Values in an event: more than a tree of 10,000 nodes has."""


class UnreadableEvent(ValueError):
    """Bytes that are no event of a process."""


def read_event(data: bytes) -> messages.Event:
    """The event in these bytes, which nobody has to be trusted for. No code is called but that of this module and of the values of events, and no module is
    imported. Raises `UnreadableEvent`."""
    try:
        event = _Reading(data, Steps(STEPS)).load()
        check_extent(event, STEPS)
    except Exception as error:
        raise UnreadableEvent(f"{type(error).__name__}: {error}") from error
    if not isinstance(event, _EVENTS) or not _fits(event, type(event)):
        raise UnreadableEvent(f"it is {event!r:.200}")
    return event


def _fits(value: object, kind: Any) -> bool:
    """Whether a value is of this type, as the fields of events are declared, with all that it contains."""
    origin: Any = get_origin(kind)
    parts: tuple[object, ...] = get_args(kind)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in parts)
    if origin is Literal:
        return isinstance(value, str) and value in parts
    if origin in (tuple, dict):
        return type(value) is origin and _contents_fit(cast("Collection[Any]", value), parts)
    if not isinstance(value, (int, float) if kind is float else kind):
        return False
    return not isinstance(value, Struct) or all(_fits(getattr(value, name), one) for name, one in _hints(kind).items())


def _contents_fit(values: Collection[object], parts: tuple[object, ...]) -> bool:
    """Whether what is in a tuple is of these types, or what the names of a dictionary are."""
    if isinstance(values, tuple) and parts[1:] != (...,):
        return len(values) == len(parts) and all(map(_fits, values, parts))
    return all(_fits(one, parts[0]) for one in values)


@cache
def _hints(kind: type) -> dict[str, object]:
    return get_type_hints(kind)


class _Foreign:
    """Stands for a value of a class or a function that is not called here."""

    named: tuple[str, str] = "", ""

    def __new__(cls, *arguments: object, **keywords: object) -> _Foreign:
        return super().__new__(cls)

    def __init__(self, *arguments: object, **keywords: object) -> None:
        """Take what the real class takes."""

    def __repr__(self) -> str:
        return f"<{'.'.join(self.named)} of another machine>"


class _Reading(BoundedUnpickler):
    def find_class(self, module: str, name: str, /) -> object:
        made = _MADE.get(f"{module}:{name}")
        # Never the class itself: the bytes can set attributes of what they have named.
        return _foreign(module, name) if made is None else partial(made)

    def refuse(self, value: object) -> None:
        if not isinstance(value, _Foreign):
            super().refuse(value)


@lru_cache(1000)
def _foreign(module: str, name: str) -> type[_Foreign]:
    return type(name, (_Foreign,), {"named": (module, name)})


def _class_of(kind: object, base: type[T]) -> type[T] | None:
    """The class that is meant, if a module that is loaded here has it and it is one of these; else None."""
    module, name = getattr(kind, "named", ("", ""))
    found: object = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, "__dict__", {}).get(part)
    return found if isinstance(found, type) and issubclass(found, base) else None


def _child(kind: object, fields: dict[str, object]) -> Child:
    """A declaration, for the names that it gives; its factory is not called here."""
    told: dict[str, Any] = {**fields, "factory": _class_of(fields.get("factory"), Node) or Node}
    return Child(**told)


def _error(
    kind: Any, args: tuple[object, ...], state: dict[str, object], notes: tuple[str, ...], cause: BaseException | None
) -> Exception:
    """An error, without a call of its class: see `actors.processes.pickling`. One of a class that is not loaded here is a `RemoteError`."""
    found = RemoteError if getattr(kind, "func", None) is RemoteError else _class_of(kind, Exception)
    if found is None:
        error: Exception = RemoteError(str(kind.named[1]), ", ".join(map(str, args)))
    else:
        error = cast("Exception", new_error(found, args))
        error.__dict__.update(state)
    for note in notes:
        error.add_note(note)
    error.__cause__ = cause
    return error


_REASONS: Final = (reasons.Returned, reasons.Stopped, reasons.Failed, reasons.Killed, reasons.Leaked)
_VALUES: Final = (
    *_EVENTS,
    messages.NodeFacts,
    *_REASONS,
    reasons.Gone,
    Report,
    ChildRef,
    Backoff,
    Child,
    RemoteError,
    Level,
)
_MADE: Final[dict[str, Callable[..., object]]] = {
    **{f"{one.__module__}:{one.__qualname__}": one for one in _VALUES},
    "actors.supervision.declaration:_rebuild": _child,
    "actors.processes.pickling:_rebuilt": _error,
}
"""What is called while an event is read, by MODULE:NAME. None of it does more than to make a value."""
