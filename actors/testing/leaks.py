"""The check for what a system leaves over when it has ended: tasks, threads, endpoints and goals."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.system import System
    from actors.time.virtual_loop import VirtualLoop

ENDING_SECONDS = 0.5
"""How long, in seconds of real time, a thread may take to end before it counts as left over."""


class Leak(AssertionError):
    """Something has outlived the system that owned it."""


class LeakWatch:
    """Finds what a system has left over.

    Invariant: tasks and threads that ran when the watch was created are never reported.
    """

    def __init__(self, loop: VirtualLoop) -> None:
        self._loop = loop
        self._tasks = asyncio.all_tasks(loop)
        self._threads = set(threading.enumerate())

    def forgive_threads(self) -> None:
        """Exclude the threads that run now from the check, because what would have ended them was interrupted."""
        self._threads |= set(threading.enumerate())

    def left_over(self, system: System) -> list[str]:
        """Describe the tasks, threads, endpoints and goals that a system has left over, one phrase each, sorted."""
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
    """Whether a thread is still running. One that has already delivered its result may need a moment of real time to end."""
    thread.join(ENDING_SECONDS)
    return thread.is_alive()


def _is_pooled(thread: threading.Thread, loop: VirtualLoop) -> bool:
    """Whether a thread belongs to the pool of the loop or of anyio. It waits for work and ends with the loop."""
    executor = getattr(loop, "_default_executor", None)
    return thread in getattr(executor, "_threads", ()) or type(thread).__module__.startswith("anyio.")
