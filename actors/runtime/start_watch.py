"""Reporting start phases that do not end, with the line at which the node waits."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.inbox.boundary import BOUNDARY, outside
from actors.places import awaited_in

if TYPE_CHECKING:
    from actors.actions.driver import Host

HUNG_SECONDS = 5.0
"""A start phase that lasts for this long, in seconds, is reported once."""


class StartWatch:
    """Logs a warning, once, for each start phase of one system that has lasted `HUNG_SECONDS`.

    One timer serves all start phases. On the virtual clock there is no timer while nothing starts, so that a deadlock is found at the
    moment at which it begins, and not when the timer fires.

    Invariants:

    - `_begun` holds the start phases that are under way and were not reported, the oldest first.
    - While `_begun` is not empty, `_timer` is set and fires no later than the oldest of them has to be reported.
    """

    __slots__ = ("_begun", "_held", "_loop", "_timer", "_virtual")

    def __init__(self, loop: asyncio.AbstractEventLoop, *, virtual: bool) -> None:
        self._loop = loop
        self._virtual = virtual
        self._begun: dict[Host, float] = {}
        """Life of a node -> when its start phase began, loop time in seconds."""
        self._held = False
        self._timer: asyncio.TimerHandle | None = None

    def hold(self) -> None:
        """Keep the timer between the starts that follow until `release`."""
        self._held = True

    def release(self) -> None:
        """End `hold`: the starts are over."""
        self._held = False
        if self._virtual:
            self._rest()

    def begin(self, node: Host) -> None:
        """Note that the start phase of `node` begins."""
        if BOUNDARY.get() is not None:
            with outside():
                return self.begin(node)
        self._begun[node] = now = self._loop.time()
        if self._timer is None:
            self._timer = self._loop.call_at(now + HUNG_SECONDS, self._look)

    def end(self, node: Host) -> None:
        """Note that the start phase has ended, in whichever way. Calling it twice is fine."""
        if self._begun.pop(node, None) is not None and self._virtual:
            self._rest()

    def close(self) -> None:
        """Forget all start phases and stop the timer."""
        self._begun.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _rest(self) -> None:
        """Stop the timer while nothing starts; on the virtual clock only. On the real clock one needless call is cheaper than this."""
        if not self._begun and not self._held:
            self.close()

    def _look(self) -> None:
        self._timer = None
        soon = self._loop.time() + 1e-6
        for node, begun in list(self._begun.items()):
            if begun + HUNG_SECONDS > soon:
                self._timer = self._loop.call_at(begun + HUNG_SECONDS, self._look)
                return
            del self._begun[node]
            task = node.inbox.task
            node.warn(
                f"still starting after {HUNG_SECONDS:g} s", awaits="" if task is None else awaited_in(task),
                remedy="what comes after it in its supervisor waits, too: let on_start return, and wait in a @background method or with a "
                "timeout; a node that it waits for has to come before it",
            )  # fmt: skip
