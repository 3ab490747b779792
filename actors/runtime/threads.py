"""`CallsFromThreads`: calls into the event loop from other threads."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Lock


class CallsFromThreads:
    """Has the event loop call functions that other threads submit, in the order in which they were submitted.

    Invariants: while `_waiting` is not empty, exactly one wake-up of the loop is under way, for any number of functions.
    """

    __slots__ = ("_lock", "_loop", "_waiting")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lock = Lock()
        self._waiting: list[Callable[[], object]] = []

    def submit(self, function: Callable[[], object]) -> None:
        """Have the event loop call `function`, which must not raise. From any thread. Raises RuntimeError if the loop is closed."""
        with self._lock:
            if not self._waiting:
                self._loop.call_soon_threadsafe(self._drain)
            self._waiting.append(function)

    def _drain(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for function in waiting:
            function()
