"""`Requests`: what code outside of a launch asks of it, from any thread."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext
    from actors.launch.entity import LaunchDescriptionEntity

Take = Callable[[Sequence["LaunchDescriptionEntity"], "LaunchContext"], None]
"""Carries out entities in a context, in the event loop of the launch."""


class Requests:
    """Entities that a launch is to carry out, added from any thread.

    With `stay`, the launch goes on although nothing runs, because more may come. Those that are added before the launch begins wait for it;
    those added after its end are dropped.

    Invariants: `_waiting` is empty once the launch has begun. `_take` is set exactly while the launch runs.
    """

    def __init__(self, *, stay: bool = False) -> None:
        self.stay = stay
        self._lock = Lock()
        self._waiting: list[tuple[Sequence[LaunchDescriptionEntity], LaunchContext]] = []
        self._take: Take | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def add(self, entities: Sequence[LaunchDescriptionEntity], context: LaunchContext) -> None:
        """Have the launch carry out these entities."""
        with self._lock:
            if self._loop is None:
                self._waiting.append((entities, context))
            elif self._take is not None:
                self._loop.call_soon_threadsafe(self._take, entities, context)

    def begin(self, take: Take) -> None:
        """The launch runs in this event loop: `take` carries out what waits, and then what comes."""
        with self._lock:
            self._loop, self._take = asyncio.get_running_loop(), take
            waiting, self._waiting = self._waiting, []
        for entities, context in waiting:
            take(entities, context)

    def end(self) -> None:
        """The launch ends: nothing is carried out any more."""
        with self._lock:
            self._take = None
