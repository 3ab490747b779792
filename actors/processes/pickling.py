"""Copying values between processes: `pickle`, but that every error crosses, with its traceback as a note."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from io import BytesIO
from typing import Any, Final, TypeAlias, cast

from actors.errors import RemoteError
from actors.places import traceback_of

_Reduced: TypeAlias = tuple[Callable[..., BaseException], tuple[object, ...]]

_HEAD: Final = "In process"


def pack(value: object) -> bytes:
    """The value as bytes. Raises what `pickle` raises for a value that cannot be copied; errors always can."""
    out = BytesIO()
    _Pickler(out, pickle.HIGHEST_PROTOCOL).dump(value)
    return out.getvalue()


def unpack(data: bytes) -> Any:
    """The value that `pack` made bytes of. The data comes from a process of this tree, which is trusted as this one is."""
    return pickle.loads(data)


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: object) -> Any:
        """Errors: by class, arguments and attributes. `pickle` would call the class with its arguments, which few classes support."""
        if not isinstance(obj, BaseException):
            return NotImplemented
        return _reduced(obj)


def _reduced(error: BaseException) -> _Reduced:
    kind = type(error)
    notes = tuple(getattr(error, "__notes__", ()))
    if not any(note.startswith(_HEAD) for note in notes):  # else it comes from a process below this one
        notes += _told(error)
    cause = error.__cause__
    args = (
        cast("tuple[Any, ...]", error.__reduce__()[1]) if isinstance(error, OSError) else error.args
    )  # with its file names
    state = {name: value for name, value in vars(error).items() if name != "__notes__"}
    try:
        pack((kind, args, state))
    except Exception:
        return _rebuilt, (
            RemoteError,
            (str(RemoteError(kind.__qualname__, str(error))),),
            {"kind": kind.__qualname__},
            notes,
            cause,
        )
    return _rebuilt, (kind, args, state, notes, cause)


def _told(error: BaseException) -> tuple[str, ...]:
    """The traceback of an error of this process, as a note; nothing for one that was never raised here."""
    shown = None if error.__traceback__ is None else traceback_of(error)
    return () if shown is None else (f"{_HEAD} {os.getpid()}:\n{''.join(shown.format(chain=False)).rstrip()}",)


def _rebuilt(
    kind: type[BaseException],
    args: tuple[object, ...],
    state: dict[str, object],
    notes: tuple[str, ...],
    cause: BaseException | None,
) -> BaseException:
    error = kind.__new__(kind, *args)  # not `kind(*args)`: what `args` holds is seldom what the class takes
    vars(error).update(state)
    for note in notes:
        error.add_note(note)
    error.__cause__ = cause
    return error
