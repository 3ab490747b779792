"""Deadlocks of locks: tasks each of which waits for a lock that the next one holds.

asyncio does not record who holds a lock. A task that is suspended inside ``async with lock:`` keeps the bound method ``lock.__aexit__`` on
the stack of its coroutine, where the garbage collector finds it. Locks taken by `acquire()` without ``async with`` are not found.
"""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Iterable
from types import FrameType, MethodType
from typing import Any

import anyio

from actors.places import parked


def circle_of_locks(tasks: Iterable[asyncio.Task[Any]]) -> tuple[asyncio.Task[Any], ...]:
    """Return the tasks of one deadlock, each waiting for a lock of the next, the last for one of the first; empty if there is none."""
    waiting: dict[asyncio.Task[Any], object] = {}
    holders: dict[int, asyncio.Task[Any]] = {}
    for task in tasks:
        chain = parked(task)
        lock = _awaited(chain[-1][1]) if chain else None
        if lock is None:
            continue
        waiting[task] = lock
        held = [each for owner, _ in chain for each in _entered(owner)]
        if lock in held:  # a task that waits to enter has `__aexit__` on its stack already
            held.remove(lock)
        holders.update((id(each), task) for each in held)
    for first in waiting:
        path = [first]
        while (following := holders.get(id(waiting[path[-1]]))) is not None and following not in path:
            path.append(following)
        if following is first:
            return tuple(path)
    return ()


def _awaited(frame: FrameType) -> object | None:
    """The lock that a task waits for; None if it waits for none."""
    lock = frame.f_locals.get("self") if frame.f_code.co_name == "acquire" else None
    return lock if isinstance(lock, (asyncio.Lock, anyio.Lock)) else None


def _entered(suspended: object) -> list[object]:
    """The locks in whose ``async with`` block a coroutine is suspended."""
    ways_out = [each for each in gc.get_referents(suspended) if isinstance(each, MethodType)]
    return [
        way.__self__
        for way in ways_out
        if way.__name__ == "__aexit__" and isinstance(way.__self__, (asyncio.Lock, anyio.Lock))
    ]
