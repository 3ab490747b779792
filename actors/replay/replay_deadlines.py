"""`ReplayDeadlines`: the timeouts of calls in a replay."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING

from actors.time.deadlines import FEW, Deadlines

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.time.deadlines import Waiting


class ReplayDeadlines(Deadlines):
    """The `Deadlines` of a system in which a recording is played. None passes by itself: the recording says which calls were not
    answered in time, and once the nodes have left it, the driver has deadlines pass when they are due.

    `now()` is the time, seconds on the clock of the event loop.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._waiting: list[Waiting] = []

    def watch(self, one: Waiting, timeout: float) -> None:
        """Have `one.future` fail with `one.late()` in `timeout` seconds."""
        one.due = self._now() + timeout
        self._waiting = [other for other in self._waiting if not other.future.done()]
        self._waiting.append(one)

    def waiting(self, limit: int = FEW) -> list[Waiting]:
        """The first `limit` objects that still wait."""
        return list(islice((one for one in self._waiting if not one.future.done()), limit))

    @property
    def due(self) -> float:
        """The next deadline; infinite without one."""
        return min((one.due for one in self._waiting if not one.future.done()), default=math.inf)

    def expire(self) -> None:
        """Let the next deadline pass."""
        late = min((one for one in self._waiting if not one.future.done()), key=lambda one: one.due)
        late.future.set_exception(late.late())

    def close(self) -> None:
        """Drop all."""
        self._waiting.clear()
