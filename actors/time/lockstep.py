"""The time of an event loop in which a world is simulated: it keeps step with that world, and slips when the machine is too slow for it.

A simulator on the real clock cannot make up for time that it has missed: what it would compute takes as long again, and meanwhile the loop is
deaf; and a world that has moved on without its controllers lets a robot fall. So here the clock waits for the program. `loop.time()` runs as
real time does while the loop keeps up. It stands still while callbacks run; while it is late it goes from one timer to the next, and all that
is due at one is done before the next. What it is late by more than `BEHIND` it never makes up: simulated time is then slower than real time.
All that uses the loop's clock (timers, timeouts, stamps) sees steady time, whether the processor is busy, the process was stopped, or the
machine slept.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable
from math import inf
from time import monotonic, thread_time
from typing import TYPE_CHECKING, Final, cast

from actors.time.real_loop import waking

if TYPE_CHECKING:
    from asyncio import SelectorEventLoop as _LoopBase
    from selectors import SelectorKey
    from selectors import SelectSelector as _SelectorBase
else:
    _LoopBase = _SelectorBase = object

BEHIND: Final = 0.05
"""Seconds that the loop makes up for when it is late; what is more is lost to simulated time."""
TURNS: Final = 32
"""For so many turns of the loop time stands still while callbacks are ready: a node that never rests slows the world down, but does not stop
it."""
OWN: Final = 0.002
"""And while these have used so much of the processor, seconds."""
STEP: Final = 0.004
"""How far time then goes on in one turn, seconds: less than the period of a control loop."""
STOPPED: Final = 0.5
"""Seconds after which a gap in which the thread hardly ran counts as a stop of the process or of the machine, not as a slow one."""
RAN: Final = 0.05
"""It hardly ran if it had less than this share of a processor."""
STALLED: Final = 1.0
"""Seconds after which a world in another process that stands still holds no clock up any more."""
GAP: Final = 0.1
"""What counts of them at most between two turns of the loop, seconds: the process may have been stopped, too."""
LEAST_WAIT: Final = 0.001
"""Seconds of the shortest wait for such a world."""


class Simulated(ABC):
    """An argument of a node that simulates a world by the loop's clock: on the real clock, `run` lets the loop keep step with it.

    `real_time` says that it must not, to measure how punctual the loop is without that.
    """

    real_time: bool = False

    @abstractmethod
    def keep_step(self, loop: asyncio.AbstractEventLoop) -> None:
        """Call `Lockstep.of(loop)`. It is called before anything starts, in each process that has the argument."""


class Lockstep:
    """The clock of one loop that keeps step. `of` gives it, and makes it once; it stays for the life of the loop.

    Invariants: loop time never goes back, is never ahead of real time, and is the same in all callbacks of a turn.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.now = self._due = loop.time()
        """Loop time, seconds."""
        self.slipped = monotonic() - self.now
        """Seconds by which loop time is behind real time for good."""
        self.stopped = 0.0
        """How much of that was lost while the process did not run at all: it was stopped, or the machine slept."""
        self._world: Callable[[], tuple[float, float]] | None = None
        """That in another process; see `follow`."""
        self._limit, self._stalled, self._looked = -inf, 0.0, 0.0
        """Up to where time may go by that, for how long it has not moved, and when that was last looked at, in real time."""
        self._held = 0
        self._held_since = self._held_own = self._own = 0.0
        self._is_woken = hasattr(loop, "waking")
        waking(loop).insert(0, self._woken)

    @classmethod
    def of(cls, loop: asyncio.AbstractEventLoop) -> Lockstep | None:
        """The clock of this loop. None for a virtual loop, which keeps step anyway, and for one that does not wait by a selector of Python."""
        found = lockstep_of(loop)
        selector = getattr(loop, "_selector", None)
        if found is None and selector is not None and not getattr(loop, "virtual", False):
            found = cls(loop)
            extend(loop, _Loop)
            extend(selector, _Selector)
            cast("_Loop", loop).lockstep = cast("_Selector", selector).lockstep = found
        return found

    def follow(self, world: Callable[[], tuple[float, float]]) -> None:
        """Keep step with a world in another process: `world` tells up to which loop time the clock may go, and what that has `slipped`.

        What this loop is late by then is made up for in one step, as on the real clock: the world has not waited for it.
        """
        if self._world is None:  # the world may have slipped long before this process was there
            self._world = world
            self.now = self._due = self._present(monotonic())
        self._world = world

    def select(
        self, select: Callable[[float | None], list[tuple[SelectorKey, int]]], timeout: float | None
    ) -> list[tuple[SelectorKey, int]]:
        """Let the loop's selector wait by `select`; then time goes on."""
        if timeout is not None and timeout <= 0.0:
            ready = select(0)
            self._hold()
            return ready
        self._held = 0
        wait: float | None = None
        self._due = inf
        if timeout is not None:
            self._due = self.now + timeout
            wait = max(0.0, self._due - self._present(monotonic()))
            if wait > 0.0 and self._world is not None:
                wait = max(wait, LEAST_WAIT)
        ready = select(wait)
        if not self._is_woken or wait == 0.0:
            self._woken()
        return ready

    def _woken(self) -> None:
        """The loop wakes. It may call this before `select` returns, for others who want to know the time then."""
        self._reach(self._due)

    def _hold(self) -> None:
        """Callbacks are ready: time stands still until they have run, unless they are too many."""
        now = monotonic()
        if self._held == 0:
            self._held_since, self._held_own = now, thread_time()
        self._held += 1
        if self._held > TURNS or (now - self._held_since > OWN and thread_time() - self._held_own > OWN):
            self._held = 0
            self._reach(self.now + STEP)

    def _present(self, real: float) -> float:
        """Where loop time would be, at `real` time, if all were done that is due."""
        if self._world is None:
            return real - self.slipped
        limit, slipped = self._world()
        if slipped - self.slipped > STOPPED:
            self.stopped += slipped - self.slipped
        self.slipped = slipped
        gap, self._looked = real - self._looked, real
        self._stalled = self._stalled + min(gap, GAP) if limit == self._limit else 0.0
        self._limit = limit
        return real - slipped if self._stalled > STALLED else min(limit, real - slipped)

    def _reach(self, due: float) -> None:
        """Go on to the present, but not beyond `due`. What cannot be made up for is lost."""
        real = monotonic()
        own, self._own = self._own, thread_time()
        present = self._present(real)
        self.now = max(self.now, min(present, due))
        lost = present - self.now - BEHIND
        if lost <= 0.0:
            return
        if self._world is not None:
            self.now += lost
            return
        self.slipped += lost
        if lost > STOPPED and self._own - own < RAN * lost:
            self.stopped += lost


def lockstep_of(loop: asyncio.AbstractEventLoop) -> Lockstep | None:
    """The clock of this loop, if it keeps step."""
    return loop.lockstep if isinstance(loop, _Loop) else None


class _Loop(_LoopBase):
    """The methods of a loop that keeps step, before those of its class."""

    lockstep: Lockstep

    def time(self) -> float:
        return self.lockstep.now


class _Selector(_SelectorBase):
    """The methods of the selector of such a loop."""

    lockstep: Lockstep

    def select(self, timeout: float | None = None) -> list[tuple[SelectorKey, int]]:
        return self.lockstep.select(super().select, timeout)


def extend(instance: object, mixin: type) -> None:
    """Let `instance` be of a class derived from its present one, with the methods of `mixin` before its own. It stays so for good.

    `mixin` calls the methods that it overrides by `super()`. Raises `TypeError` for an object that is not of a class written in Python.
    """
    kind = type(instance)
    instance.__class__ = type(kind.__name__, (mixin, kind), {"__module__": kind.__module__})
