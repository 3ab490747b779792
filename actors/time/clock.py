"""The clock of a system, real or virtual: its time in seconds, and the stamps of its messages."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from typing import Any

from actors.checks import NoPublicConstructor
from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage
from actors.time.values import stamp_of
from actors.waiting import wake


class Clock(metaclass=NoPublicConstructor):
    """The clock of one system. It follows the event loop, so it is virtual on a virtual loop.

    `now()` is the time since the system started, in seconds. It never goes back; durations and deadlines use it. `wall()` is the time of
    day in seconds since 1970. On a virtual loop it begins at 0 with `now()`, so that runs are repeatable.

    It has no public constructor: `Node.clock` and `System.clock` are one.
    """

    __slots__ = ("_epoch", "_epoch_ns", "_has_cheap_sleep", "_loop", "_origin", "_plain", "_since_ns", "virtual")

    def __init__(self, loop: asyncio.AbstractEventLoop, *, virtual: bool) -> None:
        self._loop = loop
        self._has_cheap_sleep = hasattr(loop, "sleep_until")
        self._origin = loop.time()
        epoch: float | None = getattr(loop, "epoch", None)
        self._epoch = epoch if epoch is not None else 0.0 if virtual else time.time()
        self._epoch_ns = round(self._epoch * 1e9)
        counted = getattr(loop.time, "__func__", loop.time) in (time.monotonic, asyncio.BaseEventLoop.time)
        self._plain = type(loop) if counted else None
        """The loop's class if its time is that of `time.monotonic_ns`; a loop whose class `lockstep.extend` has changed has a time of its own."""
        self._since_ns = round(self._origin * 1e9)
        self.virtual = virtual

    def __repr__(self) -> str:
        return f"<{'virtual' if self.virtual else 'real'} clock at {self.now():.6f} s>"

    @property
    def origin(self) -> float:
        """The event loop's time, in seconds, when `now()` was 0."""
        return self._origin

    @property
    def epoch(self) -> float:
        """The time of day, in seconds since 1970, when `now()` was 0."""
        return self._epoch

    def now(self) -> float:
        """The time since the system started, in seconds."""
        return self._loop.time() - self._origin

    def now_ns(self) -> int:
        """`now()` in whole nanoseconds."""
        return round(self.now() * 1e9)

    def wall(self) -> float:
        """The time of day in seconds since 1970; on a virtual loop, since the start."""
        return self._epoch + self.now()

    def wall_ns(self) -> int:
        """`wall()` in whole nanoseconds."""
        if type(self._loop) is self._plain:  # a message of another process costs one: this takes half the time
            return self._epoch_ns + time.monotonic_ns() - self._since_ns
        return self._epoch_ns + round((self._loop.time() - self._origin) * 1e9)

    def wall_ns_at(self, now: float) -> int:
        """What `wall_ns()` was or will be when `now()` is `now`."""
        return self._epoch_ns + round(now * 1e9)

    def shift_wall(self, seconds: float) -> None:
        """Change the time of day by `seconds`, as a person or NTP does. `wall()` and stamps jump, `now()` does not."""
        self._epoch += seconds
        self._epoch_ns = round(self._epoch * 1e9)

    def stamp(self, now: float | None = None) -> TimeMessage:
        """`wall()` as a ``builtin_interfaces/msg/Time`` for message headers; with `now`, the stamp of that instant."""
        return stamp_of(self.wall_ns() if now is None else self.wall_ns_at(now))

    def loop_time(self, now: float) -> float:
        """The event loop's time, in seconds, at which `now()` is `now`."""
        return self._origin + now

    def call_at(self, instant: float, callback: Callable[[], object]) -> asyncio.TimerHandle | asyncio.Future[bool]:
        """Call `callback` in the loop when `now()` reaches `instant`, unless the returned object is canceled (`.cancel()`) first.

        The caller has to cancel it; it does not end with a node. Under simulated time, `callback` is also called when simulated time is
        switched off or its node ends, so it must check the clock itself.
        """
        return self._loop.call_at(self._origin + instant, callback)

    async def sleep(self, seconds: float) -> bool:
        """Wait for `seconds`, and for at least one turn of the loop even if they are zero or negative. NaN and infinity are refused.

        True when they have passed. False only under simulated time, if it is switched off in the meantime (see `actors.runtime.sim_time`).
        """
        if not math.isfinite(seconds):
            raise ValueError(f"clock.sleep({seconds}): the duration must be a finite number of seconds")
        await asyncio.sleep(max(0.0, seconds))
        return True

    async def sleep_until(self, instant: float) -> bool:
        """Wait until `now()` reaches `instant`; for one turn of the loop if it has passed. Returns what `sleep` returns."""
        if not math.isfinite(instant):
            raise ValueError(f"clock.sleep_until({instant}): the instant must be a finite number of seconds")
        loop: Any = self._loop
        when = self._origin + instant
        if when <= loop.time():
            await asyncio.sleep(0)
            return True
        if self._has_cheap_sleep:  # on a virtual loop
            await loop.sleep_until(when)
            return True
        future: asyncio.Future[None] = loop.create_future()
        timer = loop.call_at(when, wake, future, None)
        try:
            await future
        finally:
            timer.cancel()
        return True
