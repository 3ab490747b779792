"""The check for what a system leaves behind when it has ended: tasks, threads, subscriptions, goals."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.system import System
    from actors.time.virtual_loop import VirtualLoop

__all__ = ["Leak", "LeakWatch"]

ENDING_SECONDS = 0.5
"""Real seconds within which a thread that is not left over ends."""


class Leak(AssertionError):
    """Something outlived the system that owned it."""


class LeakWatch:
    """Invariant: what ran when the watch was made is never called left over."""

    def __init__(self, loop: VirtualLoop) -> None:
        self._loop = loop
        self._tasks = asyncio.all_tasks(loop)
        self._threads = set(threading.enumerate())

    def forgive_threads(self) -> None:
        """Threads that run now are none that the system has left over: whoever would have ended them was not allowed to."""
        self._threads |= set(threading.enumerate())

    def left_over(self, system: System) -> list[str]:
        """The tasks, threads, endpoints and goals that a system has left behind, each in a phrase."""
        left = [
            f"task {task.get_name()}"
            for task in asyncio.all_tasks() - self._tasks
            if task is not asyncio.current_task()
        ]
        threads = set(threading.enumerate()) - self._threads
        left += [
            f"thread {thread.name}" for thread in threads if not _is_pooled(thread, self._loop) and _goes_on(thread)
        ]
        for entry in system.graph.topics.values():
            left += [repr(endpoint) for endpoint in (*entry.publishers, *entry.subscriptions)]
        for state in system.nodes.values():
            left += [
                server.describe(goal)
                for server in state.actions.values()
                for goal in (*server.running, *server.waiting)
            ]
        return sorted(left)


def _goes_on(thread: threading.Thread) -> bool:
    """Whether a thread has more to do; one that has told the loop its result may need a moment of real time to end."""
    thread.join(ENDING_SECONDS)
    return thread.is_alive()


def _is_pooled(thread: threading.Thread, loop: VirtualLoop) -> bool:
    """Whether a thread is the loop's own, or anyio's: it waits for its next job, and ends with the loop."""
    executor = getattr(loop, "_default_executor", None)
    return thread in getattr(executor, "_threads", ()) or type(thread).__module__.startswith("anyio.")
