"""The user's line: where an error was raised, where a task waits, which line a thread executes.

Several lines of a stack lead to a place. The one that is shown is the innermost line of the user's own code; without any, the innermost
line of a third-party package; without any, the innermost line of Python itself. A package counts as the user's, wherever it is installed,
when it defines a node class. A line of `actors` is shown for a task that waits if there is no other, and never for an error.
"""

from __future__ import annotations

import asyncio
import gc
import os
import sys
from collections.abc import Iterable, Iterator
from functools import lru_cache
from traceback import StackSummary, TracebackException
from types import AsyncGeneratorType, CodeType, CoroutineType, FrameType, GeneratorType, TracebackType
from typing import Any, Final, NamedTuple, TypeVar, cast

from actors.errors import ActorError, DeclarationError, described

E = TypeVar("E", bound=BaseException)

USER, PACKAGE, PYTHON, ACTORS = range(4)
"""The owners of files, the one nearest to the user first."""

_OURS: Final = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
_MADE: Final = ("<check of ", "<CDR ")
"""How the names of code begin that `actors` makes for each message type."""
_PYTHON: Final = os.path.join(os.path.dirname(os.path.abspath(os.__file__)), "")
_ASYNCIO: Final = os.path.join(_PYTHON, "asyncio", "")
_CARRIER: Final = os.path.join(_OURS, "inbox", "control.py")
"""The file that raises errors on behalf of others: an error whose innermost line is there was never raised anywhere else."""
_BRINGER: Final = os.path.join(_OURS, "processes", "life.py")
"""The file that raises the errors of other processes: the lines of this process say nothing about them."""
_OUR_ERRORS: Final = (ActorError, DeclarationError)
_INSTALLED: Final = ("site-packages", "dist-packages")
_MACHINERY: Final = frozenset(("anyio", "sniffio"))
"""Installed packages that count as part of Python, as asyncio does."""

_SUSPENDED: Final[dict[type, tuple[str, str]]] = {
    CoroutineType: ("cr_frame", "cr_await"),
    AsyncGeneratorType: ("ag_frame", "ag_await"),
    GeneratorType: ("gi_frame", "gi_yieldfrom"),
}
"""Kind of suspended object -> its attributes for its frame and for what it waits for."""

_claimed: set[str] = set()


class Place(NamedTuple):
    """One line of a program."""

    file: str
    line: int
    function: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} in {self.function}"


def claim(module: str) -> None:
    """Count the package of this module as the user's own, also if it is installed, because it defines a node class."""
    if (package := module.partition(".")[0]) not in _claimed:
        _claimed.add(package)
        owner_of.cache_clear()


@lru_cache(maxsize=4096)
def owner_of(file: str) -> int:
    """The owner of a file: `USER`, `PACKAGE`, `PYTHON` or `ACTORS`."""
    owner, package = _filed(file)
    return USER if owner == PACKAGE and package in _claimed else owner


def origin_of(error: BaseException) -> Place | None:
    """The line that raised an error; None if it was never raised, or only by `actors`."""
    trace, nearest = error.__traceback__, ACTORS
    best: TracebackType | None = None
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        owner = owner_of(file)
        if owner <= nearest and owner != ACTORS and not file.startswith(_ASYNCIO):
            best, nearest = trace, owner
        trace = trace.tb_next
    return None if best is None else _place(best.tb_frame.f_code, best.tb_lineno)


def place_of(error: BaseException) -> str:
    """The line that raised an error, as ``file:line in function``; empty if it was never raised, or only by `actors`."""
    place = origin_of(error)
    return "" if place is None else str(place)


def error_fields(error: BaseException) -> dict[str, Any]:
    """The fields of a log line about an error: `error`, its type and text, and `at`, the line that raised it, unless only `actors` did."""
    place = place_of(error)
    return {"error": described(error)} | ({"at": place} if place else {})


def traceback_of(error: BaseException) -> TracebackException | None:
    """The traceback of an error and of its causes for display, each from the user's outermost line on; whole where the user has no line.

    An error that `actors` raised on purpose ends at the user's innermost line, because its text says all.

    None for an error that was never raised, and for one that `actors` itself raised: its text says all. The answer holds no frames.
    """
    if isinstance(error, _OUR_ERRORS) and origin_of(error) is None:
        return None
    whole = TracebackException.from_exception(error, lookup_lines=False)
    if not whole.stack or whole.stack[-1].filename == _CARRIER:
        return None
    if whole.stack[-1].filename == _BRINGER:  # a note of the error tells its lines
        whole.stack.clear()
    _cut(whole, error)
    return whole


def users_trace(error: BaseException) -> TracebackType | None:
    """The lines of `traceback_of` as a new traceback. None for an error of another process, of which a note tells the lines."""
    steps: list[TracebackType] = []
    trace = error.__traceback__
    while trace is not None:
        steps.append(trace)
        trace = trace.tb_next
    files = [step.tb_frame.f_code.co_filename for step in steps]
    shown = _span(files, error)
    if shown == slice(None) and _BRINGER in files[-1:]:
        return None
    cut: TracebackType | None = None
    for step in reversed(steps[shown]):
        cut = TracebackType(cut, step.tb_frame, step.tb_lasti, step.tb_lineno)
    return cut


def shortened(error: E) -> E:
    """The error as it is to be raised to a user: without the lines of `actors` that it has come through, and those of its causes."""
    cause = error.__cause__
    while cause is not None:
        cause.__traceback__ = users_trace(cause)
        cause = cause.__cause__
    return error.with_traceback(None)


def parked(task: asyncio.Task[object]) -> list[tuple[object, FrameType]]:
    """The frames of a suspended task, outermost first, each with the coroutine or generator that it belongs to."""
    return chain_of(task.get_coro())


def chain_of(awaited: object) -> list[tuple[object, FrameType]]:
    """The frames of a suspended coroutine or generator, as `parked` gives those of a task."""
    chain: list[tuple[object, FrameType]] = []
    while awaited is not None:
        if type(awaited) not in _SUSPENDED:
            awaited = _wrapped(awaited)
            continue
        owner = awaited
        frame, awaited = (getattr(owner, attribute) for attribute in _SUSPENDED[type(owner)])
        if frame is None or any(frame is known for _, known in chain):  # finished, or a cycle of awaitables
            break
        chain.append((owner, frame))
    return chain


def users_own(frames: Iterable[FrameType]) -> Place:
    """The line to show of `frames`, which are given from the outermost to the innermost and must not be empty."""
    place = _users_own(_place(frame.f_code, frame.f_lineno) for frame in frames)
    assert place is not None
    return place


def awaited_in(task: asyncio.Task[object]) -> str:
    """The line at which a suspended task waits, as ``file:line in function``; empty when the task is running."""
    place = _users_own(_place(frame.f_code, frame.f_lineno) for _, frame in parked(task))
    return "" if place is None else str(place)


def line_of(thread: int) -> str:
    """The line that a thread executes now, as ``file:line in function``; empty if the thread has ended.

    For a thread that runs an event loop it is a line of the code that the loop runs, never one of asyncio.
    """
    # `sys._current_frames` is documented, in spite of its underscore, and the only way to the stack of another thread
    innermost = sys._current_frames().get(thread)  # pyright: ignore[reportPrivateUsage]
    place = _users_own(place for place in reversed(list(_outwards(innermost))) if not place.file.startswith(_ASYNCIO))
    return "" if place is None else str(place)


def _users_own(places: Iterable[Place]) -> Place | None:
    """The innermost of those `places` whose owner is nearest to the user; None without places. They are given outermost first."""
    best: Place | None = None
    nearest = ACTORS
    for place in places:
        owner = owner_of(place.file)
        if owner <= nearest:
            best, nearest = place, owner
    return best


def _filed(file: str) -> tuple[int, str]:
    """The owner of a file, and the name of its package if that is installed. Packages that were claimed are not considered."""
    if file.startswith((_OURS, *_MADE)):
        return ACTORS, ""
    parts = file.split(os.sep)
    for folder in _INSTALLED:
        if folder in parts[:-1]:
            package = parts[len(parts) - parts[::-1].index(folder)].removesuffix(".py")
            return (PYTHON if package in _MACHINERY else PACKAGE), package
    return (PYTHON if file.startswith((_PYTHON, "<frozen ")) else USER), ""


def _wrapped(awaitable: object) -> object:
    """The coroutine or generator behind an awaitable such as `agen.asend(x)` or `coro.__await__()`, which has no attribute for it."""
    return next((inner for inner in gc.get_referents(awaitable) if type(inner) in _SUSPENDED), None)


def _outwards(frame: FrameType | None) -> Iterator[Place]:
    while frame is not None and frame.f_code.co_name != "run_forever":
        yield _place(frame.f_code, frame.f_lineno)
        frame = frame.f_back


def _place(code: CodeType, line: int) -> Place:
    return Place(code.co_filename, line, code.co_qualname)


def _cut(shown: TracebackException, error: BaseException) -> None:
    """Leave only the lines of interest in this traceback, and in those of its causes."""
    shown.stack = StackSummary.from_list(shown.stack[_span([line.filename for line in shown.stack], error)])
    members: tuple[BaseException, ...] = cast("Any", error).exceptions if isinstance(error, BaseExceptionGroup) else ()
    for part, its in (
        (shown.__cause__, error.__cause__),
        (shown.__context__, error.__context__),
        *zip(shown.exceptions or (), members, strict=False),
    ):
        if part is not None and its is not None:
            _cut(part, its)


def _span(files: list[str], error: BaseException) -> slice:
    """The lines of a traceback to show: from the user's first, to the last, or to the user's last if `actors` raised `error` on purpose."""
    owners = [owner_of(file) for file in files]
    if USER not in owners:
        return slice(None)
    end = len(owners)
    while isinstance(error, _OUR_ERRORS) and owners[end - 1] == ACTORS:
        end -= 1
    return slice(owners.index(USER), end)
