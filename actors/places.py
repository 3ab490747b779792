"""The user's line: where an error arose, where a task waits, what a thread is at.

People look for their own code. Of all the lines that lead to a place, the one that is told is the innermost that is the user's own; without
one, the innermost of a third-party package; without one, that of Python itself. A package is the user's, wherever it is installed, when it
defines a class of nodes. Lines of `actors` are told of what waits when there are no others, and of errors never.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterable, Iterator
from functools import lru_cache
from traceback import StackSummary, TracebackException
from types import AsyncGeneratorType, CoroutineType, GeneratorType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.errors import ActorError, DeclarationError

if TYPE_CHECKING:
    import asyncio
    from types import CodeType, FrameType, TracebackType

__all__ = [
    "Place",
    "awaited_in",
    "chain_of",
    "claim",
    "line_of",
    "origin_of",
    "owner_of",
    "parked",
    "place_of",
    "traceback_of",
    "users_own",
    "users_trace",
]

USER, PACKAGE, PYTHON, ACTORS = range(4)
"""Whose a file is, the nearest first."""

_OURS: Final = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
_PYTHON: Final = os.path.join(os.path.dirname(os.path.abspath(os.__file__)), "")
_CARRIER: Final = os.path.join(_OURS, "inbox", "control.py")
"""Raises the errors of others: one that arose there was never raised by anybody else."""
_INSTALLED: Final = ("site-packages", "dist-packages")
_MACHINERY: Final = frozenset(("anyio", "sniffio"))
"""Installed packages that are as little the user's as asyncio is."""

_SUSPENDED: Final[dict[type, tuple[str, str]]] = {
    CoroutineType: ("cr_frame", "cr_await"),
    AsyncGeneratorType: ("ag_frame", "ag_await"),
    GeneratorType: ("gi_frame", "gi_yieldfrom"),
}
"""What can be suspended: where it keeps its frame, and what it waits for."""

_claimed: set[str] = set()


class Place(NamedTuple):
    """One line of a program."""

    file: str
    line: int
    function: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} in {self.function}"


def claim(module: str) -> None:
    """The package of this module is the user's own, also if it lies among the installed ones: it defines nodes."""
    _claimed.add(module.partition(".")[0])


def owner_of(file: str) -> int:
    """Whose a file is: `USER`, `PACKAGE`, `PYTHON` or `ACTORS`, the nearest to the user first."""
    owner, package = _filed(file)
    return USER if owner == PACKAGE and package in _claimed else owner


def origin_of(error: BaseException) -> Place | None:
    """Where an error arose; None if it was never raised, or by nobody but `actors`."""
    place = _users_own(_raised(error))
    return None if place is None or owner_of(place.file) == ACTORS else place


def place_of(error: BaseException) -> str:
    """Where an error arose, as ``file:line in function``; empty if it was never raised, or by nobody but `actors`."""
    place = origin_of(error)
    return "" if place is None else str(place)


def traceback_of(error: BaseException) -> TracebackException | None:
    """What there is to show of an error and of those that caused it: each from the user's outermost line on.

    Where the user has no line, all of it. None for an error that nobody raised, and for one that `actors` has raised by itself, whose text says
    all. It holds no frames.
    """
    if isinstance(error, (ActorError, DeclarationError)) and origin_of(error) is None:
        return None
    whole = TracebackException.from_exception(error, lookup_lines=False)
    if not whole.stack or whole.stack[-1].filename == _CARRIER:
        return None
    _cut(whole)
    return whole


def users_trace(error: BaseException) -> TracebackType | None:
    """The traceback of an error from the user's outermost line on; all of it where the user has no line."""
    trace = error.__traceback__
    while trace is not None and owner_of(trace.tb_frame.f_code.co_filename) != USER:
        trace = trace.tb_next
    return trace or error.__traceback__


def parked(task: asyncio.Task[Any]) -> list[tuple[object, FrameType]]:
    """In which frames a suspended task is parked, outermost first, each with the coroutine or generator that it belongs to."""
    return chain_of(task.get_coro())


def chain_of(awaited: Any) -> list[tuple[object, FrameType]]:
    """The same of a suspended coroutine or generator."""
    chain: list[tuple[object, FrameType]] = []
    while awaited is not None:
        if type(awaited) not in _SUSPENDED:
            awaited = _wrapped(awaited)
            continue
        owner = awaited
        frame, awaited = (getattr(owner, attribute) for attribute in _SUSPENDED[type(owner)])
        if frame is None or any(frame is known for _, known in chain):  # finished, or an awaitable that refers back
            break
        chain.append((owner, frame))
    return chain


def users_own(frames: Iterable[FrameType]) -> Place:
    """Of frames from the outermost to the innermost, at least one, the line of the innermost of those that are nearest to the user."""
    place = _users_own(_place(frame.f_code, frame.f_lineno) for frame in frames)
    assert place is not None
    return place


def awaited_in(task: asyncio.Task[Any]) -> str:
    """Where a suspended task waits, as ``file:line in function``; empty when it is running."""
    place = _users_own(_place(frame.f_code, frame.f_lineno) for _, frame in parked(task))
    return "" if place is None else str(place)


def line_of(thread: int) -> str:
    """Where a thread is now, as ``file:line in function``; empty for one that has ended.

    Of a thread that runs an event loop, what the loop runs: not the line that runs the loop.
    """
    # the only way into the stack of another thread, and documented, its underscore notwithstanding
    innermost = sys._current_frames().get(thread)  # pyright: ignore[reportPrivateUsage]
    place = _users_own(reversed(list(_outwards(innermost))))
    return "" if place is None else str(place)


def _users_own(places: Iterable[Place]) -> Place | None:
    """Of places from the outermost to the innermost, the innermost of those that are nearest to the user; None without places."""
    best: Place | None = None
    nearest = ACTORS
    for place in places:
        owner = owner_of(place.file)
        if owner <= nearest:
            best, nearest = place, owner
    return best


@lru_cache(maxsize=4096)
def _filed(file: str) -> tuple[int, str]:
    """Whose a file is, and the name of its package if it is an installed one."""
    if file.startswith(_OURS):
        return ACTORS, ""
    parts = file.split(os.sep)
    for folder in _INSTALLED:
        if folder in parts[:-1]:
            package = parts[len(parts) - parts[::-1].index(folder)].removesuffix(".py")
            return (PYTHON if package in _MACHINERY else PACKAGE), package
    return (PYTHON if file.startswith((_PYTHON, "<frozen ")) else USER), ""


def _raised(error: BaseException) -> Iterator[Place]:
    trace = error.__traceback__
    while trace is not None:
        yield _place(trace.tb_frame.f_code, trace.tb_lineno)
        trace = trace.tb_next


def _wrapped(awaitable: object) -> Any:
    """What an awaitable without a frame stands for: `agen.asend(x)` and `coro.__await__()` hide it from Python code."""
    return next((inner for inner in gc.get_referents(awaitable) if type(inner) in _SUSPENDED), None)


def _outwards(frame: FrameType | None) -> Iterator[Place]:
    while frame is not None and frame.f_code.co_name != "run_forever":
        yield _place(frame.f_code, frame.f_lineno)
        frame = frame.f_back


def _place(code: CodeType, line: int) -> Place:
    return Place(code.co_filename, line, code.co_qualname)


def _cut(shown: TracebackException) -> None:
    """Leave out, here and in what it is chained to, the lines before the user's first."""
    owners = [owner_of(line.filename) for line in shown.stack]
    if USER in owners:
        shown.stack = StackSummary.from_list(shown.stack[owners.index(USER) :])
    for part in (shown.__cause__, shown.__context__, *(shown.exceptions or ())):
        if part is not None:
            _cut(part)
