"""Which task waits for what, at which line and since when: the text of `Deadlock`, `Livelock` and `Stalled`."""

from __future__ import annotations

import asyncio
import gc
import linecache
import os
import re
from collections.abc import Iterable, Mapping
from types import AsyncGeneratorType, CoroutineType, FrameType, GeneratorType
from typing import Any

import anyio

__all__ = ["describe_tasks", "parked_frames", "seconds"]

_LIBRARIES = tuple(os.path.dirname(os.path.abspath(module.__file__)) + os.sep for module in (asyncio, anyio))
_MOST = 20
"""So many tasks are described; a report of hundreds would hide the one that matters."""


def describe_tasks(
    tasks: Iterable[asyncio.Task[Any]], since: Mapping[int, float], running: Iterable[asyncio.Task[Any]] = ()
) -> str:
    """One paragraph per task: name, what it waits for, since when (virtual seconds) and the line of its own code.

    `since` maps the id of a task to the time of its last step; tasks in `running` do not wait but run again and again.
    """
    busy = set(running)
    ordered = sorted(tasks, key=lambda task: (task not in busy, _natural(task.get_name())))
    lines = [_describe(task, since.get(id(task)), task in busy) for task in ordered[:_MOST]]
    if len(ordered) > _MOST:
        lines.append(f"  and {len(ordered) - _MOST} more tasks")
    return "\n".join(lines)


def parked_frames(task: asyncio.Task[Any]) -> list[FrameType]:
    """The chain of frames in which a suspended task is parked, outermost first; also through async generators."""
    frames: list[FrameType] = []
    awaited: object = task.get_coro()
    while awaited is not None:
        match awaited:
            case CoroutineType():
                frame, awaited = awaited.cr_frame, awaited.cr_await
            case AsyncGeneratorType():
                frame, awaited = awaited.ag_frame, awaited.ag_await
            case GeneratorType():
                frame, awaited = awaited.gi_frame, awaited.gi_yieldfrom
            case _:
                frame, awaited = None, _wrapped(awaited)
        if frame is not None:
            frames.append(frame)
    return frames


def seconds(time: float) -> str:
    """A time as people write it: `12.5 s`."""
    return f"{time:.9f}".rstrip("0").rstrip(".") + " s"


def _wrapped(awaitable: object) -> object:
    """What an awaitable without a frame stands for: `agen.asend(x)` and `coro.__await__()` hide it from Python code."""
    for inner in gc.get_referents(awaitable):
        if isinstance(inner, CoroutineType | AsyncGeneratorType | GeneratorType):
            return inner
    return None


def _describe(task: asyncio.Task[Any], since: float | None, runs: bool) -> str:
    frames = parked_frames(task)
    name = f"  {task.get_name()} ({getattr(task.get_coro(), '__qualname__', '?')})"
    if runs:
        head = f"{name} runs again and again"
    elif since is None:
        head = f"{name} has not run yet"
    else:
        head = f"{name} waits since {seconds(since)} for {_awaited(task, frames)}"
    own = [frame for frame in frames if not frame.f_code.co_filename.startswith(_LIBRARIES)]
    return f"{head}\n      at {_place(own[-1])}" if own else head


def _awaited(task: asyncio.Task[Any], frames: list[FrameType]) -> str:
    future = getattr(task, "_fut_waiter", None)
    if isinstance(future, asyncio.Task):
        return f"task {future.get_name()}"
    if frames and frames[-1].f_code.co_filename.startswith(_LIBRARIES):
        return frames[-1].f_code.co_qualname
    return "a future"


def _place(frame: FrameType) -> str:
    path, line = frame.f_code.co_filename, frame.f_lineno
    source = linecache.getline(path, line).strip()
    shown = os.path.relpath(path) if path.startswith(os.getcwd() + os.sep) else path
    return f"{shown}:{line} in {frame.f_code.co_qualname}" + (f": {source}" if source else "")


def _natural(name: str) -> list[tuple[int, str]]:
    """Sort key that puts Task-2 before Task-10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]
