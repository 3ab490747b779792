"""`Deadlock`, `Livelock` and `Stalled`, with reports of what each task waits for, at which line and since when."""

from __future__ import annotations

import asyncio
import linecache
import os
import re
from collections.abc import Collection, Iterable, Mapping
from types import FrameType

import anyio

from actors.places import Place, parked, users_own
from actors.time.handles import owner

_LIBRARIES = tuple(os.path.join(os.path.abspath(path), "") for path in (*asyncio.__path__, *anyio.__path__))
_MOST = 20
"""The maximum number of tasks described in a report."""

DEADLOCK = (
    "Look for the event, queue or future that nobody serves any more. A thread that the loop does not know must be "
    "started with loop.run_in_executor; for live input set loop.wait_for_io = True."
)
LIVELOCK = "Let one of them wait for time to pass; if so much work at one instant is meant, raise loop.max_spins."
STALLED = (
    "Virtual time stands still for threads and processes. If one of them waits for virtual time itself, "
    "run on the real clock; if it is only slow, raise loop.patience."
)
BUSY_SOCKETS = (
    "A task that connects or polls again without waiting keeps virtual time from moving: let it sleep between two attempts. Traffic "
    "that takes so long belongs on the real clock; or raise loop.socket_patience."
)
NO_INPUT = "For live input set loop.wait_for_io = True; if the peer is only slow, raise loop.patience."


class Deadlock(RuntimeError):
    """Every task waits, and no timer, thread, process or socket can wake one."""


class Livelock(RuntimeError):
    """Callbacks, or sockets that always have something new, keep the loop busy while virtual time stands still."""


class Stalled(RuntimeError):
    """A thread, process or socket did not respond within `VirtualLoop.patience` seconds of real time."""


def report(
    reason: str,
    now: float,
    tasks: Collection[asyncio.Task[object]],
    since: Mapping[int, float],
    ready: Iterable[object],
    remedy: str,
) -> str:
    """Build the text of a report: what happened, where each task waits and since when (in virtual seconds), and the remedy.

    `since` maps the id of a task to the time of its last step. Tasks in `ready` do not wait but run again and again.
    """
    steps = {owner(handle): handle for handle in ready}
    busy = [task for task in tasks if task in steps]
    ordered = sorted(tasks, key=lambda task: (task not in busy, _natural(task.get_name())))
    lines = [f"{reason}. The virtual clock shows {seconds(now)}."]
    lines += [f"  {handle!r} runs again and again" for task, handle in steps.items() if task not in busy]
    lines += [_describe(task, since.get(id(task)), task in busy) for task in ordered[:_MOST]]
    if not ordered:
        lines.append("  There are no tasks.")
    if len(ordered) > _MOST:
        lines.append(f"  and {len(ordered) - _MOST} more tasks")
    return "\n".join([*lines, remedy])


def parked_frames(task: asyncio.Task[object]) -> list[FrameType]:
    """The frames in which a suspended task waits, outermost first. Frames of async generators are included."""
    return [frame for _, frame in parked(task)]


def seconds(time: float) -> str:
    """A time as text for people: `12.5 s`."""
    return f"{time:.9f}".rstrip("0").rstrip(".") + " s"


def _describe(task: asyncio.Task[object], since: float | None, runs: bool) -> str:
    frames = parked_frames(task)
    name = f"  {task.get_name()} ({getattr(task.get_coro(), '__qualname__', '?')})"
    if since is None:
        head = f"{name} has not run yet"
    elif runs:
        head = f"{name} runs again and again"
    else:
        head = f"{name} waits since {seconds(since)} for {_awaited(task, frames)}"
    own = [frame for frame in frames if not frame.f_code.co_filename.startswith(_LIBRARIES)]
    if not own:
        return head
    return f"{head}\n      at {_shown(users_own(own))}"


def _awaited(task: asyncio.Task[object], frames: list[FrameType]) -> str:
    future = getattr(task, "_fut_waiter", None)
    if isinstance(future, asyncio.Task):
        return f"task {future.get_name()}"
    if frames and frames[-1].f_code.co_filename.startswith(_LIBRARIES):
        return frames[-1].f_code.co_qualname
    return "a future"


def _shown(place: Place) -> str:
    source = linecache.getline(place.file, place.line).strip()
    inside = place.file.startswith(os.getcwd() + os.sep)
    shown = place._replace(file=os.path.relpath(place.file)) if inside else place
    return f"{shown}: {source}" if source else str(shown)


def _natural(name: str) -> list[tuple[int, str]]:
    """A sort key that puts Task-2 before Task-10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]
