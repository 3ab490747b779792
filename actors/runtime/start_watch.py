"""Who does not get ready: a node whose start phase does not end is named, with the line where it waits."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.places import awaited_in

if TYPE_CHECKING:
    from actors.runtime.incarnation import Incarnation

__all__ = ["HUNG_SECONDS", "StartWatch"]

HUNG_SECONDS = 5.0
"""A start phase that lasts longer is reported, once."""


class StartWatch:
    """The start phases of one system that are under way: each that has lasted `HUNG_SECONDS` is told once.

    Invariant: while a start phase is under way, and has not been told of, `_timer` fires no later than it has to be.

    There is one timer for all of them. On the virtual clock there is none while nothing starts, so that a program that waits for ever is found
    at the moment at which it begins to.
    """

    __slots__ = ("_begun", "_held", "_loop", "_timer", "_virtual")

    def __init__(self, loop: asyncio.AbstractEventLoop, *, virtual: bool) -> None:
        self._loop = loop
        self._virtual = virtual
        self._begun: dict[Incarnation, float] = {}
        """When each began, loop time; the oldest first."""
        self._held = False
        self._timer: asyncio.TimerHandle | None = None

    def hold(self) -> None:
        """Many starts are to come, one after the other: keep the timer between them."""
        self._held = True

    def release(self) -> None:
        """They are over."""
        self._held = False
        if self._virtual:
            self._rest()

    def begin(self, life: Incarnation) -> None:
        """The start phase of this incarnation begins."""
        self._begun[life] = now = self._loop.time()
        if self._timer is None:
            self._timer = self._loop.call_at(now + HUNG_SECONDS, self._look)

    def end(self, life: Incarnation) -> None:
        """It is over, one way or the other. Ending twice is fine."""
        if self._begun.pop(life, None) is not None and self._virtual:
            self._rest()

    def close(self) -> None:
        """The system is over."""
        self._begun.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _rest(self) -> None:
        """On the real clock the timer may fire for nothing instead: that is cheaper than to cancel it for every start."""
        if not self._begun and not self._held:
            self.close()

    def _look(self) -> None:
        self._timer = None
        soon = self._loop.time() + 1e-6
        for life, begun in list(self._begun.items()):
            if begun + HUNG_SECONDS > soon:
                self._timer = self._loop.call_at(begun + HUNG_SECONDS, self._look)
                return
            del self._begun[life]
            if not life.ended:  # else it had been given up
                self._tell(life)

    def _tell(self, life: Incarnation) -> None:
        task = life.inbox.task
        life.warn(
            f"still starting after {HUNG_SECONDS:g} s", awaits="" if task is None else awaited_in(task),
            remedy="what comes after it in its supervisor waits, too: let on_start return, and wait in a @background method or with a "
            "timeout; a node that it waits for has to come before it",
        )  # fmt: skip
