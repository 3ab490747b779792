"""The clock a node meets: seconds of its system, real or virtual, and the stamps of its messages."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING

from actors.time.values import stamp_of
from actors.waiting import wake

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage

__all__ = ["Clock"]


class Clock:
    """One clock for everything a system does. It is the event loop's, so on the virtual loop it is virtual.

    `now()` is seconds since the system started; it never goes back and is what durations and deadlines use. `wall()` is the time
    of day as seconds since 1970: on the real clock the computer's, on the virtual clock `now()` itself, so that runs repeat.

    It has no public constructor: `Node.clock` and `System.clock` are one.
    """

    __slots__ = ("_epoch", "_future_at", "_loop", "_origin", "virtual")

    def __init__(self, loop: asyncio.AbstractEventLoop, *, virtual: bool) -> None:
        self._loop = loop
        self._future_at: Callable[[float], asyncio.Future[None]] | None = getattr(loop, "sleep_until", None)
        self._origin = loop.time()
        self._epoch = 0.0 if virtual else time.time()
        self.virtual = virtual

    def __repr__(self) -> str:
        return f"<{'virtual' if self.virtual else 'real'} clock at {self.now():.6f} s>"

    def now(self) -> float:
        """Seconds since the system started."""
        return self._loop.time() - self._origin

    def now_ns(self) -> int:
        """`now()` in whole nanoseconds."""
        return round(self.now() * 1e9)

    def wall(self) -> float:
        """Seconds since 1970 (virtual clock: since the start)."""
        return self._epoch + self.now()

    def wall_ns(self) -> int:
        """`wall()` in whole nanoseconds."""
        return round(self._epoch * 1e9) + self.now_ns()

    def wall_ns_at(self, now: float) -> int:
        """`wall_ns()` of the instant at which `now()` was or will be `now`."""
        return round(self._epoch * 1e9) + round(now * 1e9)

    def shift_wall(self, seconds: float) -> None:
        """Set the time of day forth or back, as a person or NTP does: `wall()` and stamps jump, `now()` does not notice."""
        self._epoch += seconds

    def stamp(self, now: float | None = None) -> TimeMessage:
        """`wall()` as a ``builtin_interfaces/msg/Time``, for message headers; with `now`, of the instant at which `now()` was that."""
        return stamp_of(self.wall_ns() if now is None else self.wall_ns_at(now))

    def loop_time(self, now: float) -> float:
        """The event loop's time at which this clock shows `now`."""
        return self._origin + now

    def call_at(self, instant: float, callback: Callable[[], object]) -> asyncio.TimerHandle | asyncio.Future[bool]:
        """Call `callback` in the loop when `now()` has reached `instant`, unless what is returned is canceled (`.cancel()`) before.

        It belongs to nobody: who asks for it cancels it. Under simulated time it is also called when that is switched off or its node ends,
        so it looks at the clock itself.
        """
        return self._loop.call_at(self._origin + instant, callback)

    async def sleep(self, seconds: float) -> bool:
        """Wait for so many seconds; at least one turn of the loop, also for zero and less. NaN and infinity are refused.

        True when they have passed; False only under simulated time, when that is switched off meanwhile (see `actors.runtime.sim_time`).
        """
        if not math.isfinite(seconds):
            raise ValueError(f"clock.sleep({seconds}): the duration must be a finite number of seconds")
        await asyncio.sleep(max(0.0, seconds))
        return True

    async def sleep_until(self, instant: float) -> bool:
        """Wait until `now()` reaches `instant`; an instant that has passed costs one turn of the loop. True and False as for `sleep`."""
        if not math.isfinite(instant):
            raise ValueError(f"clock.sleep_until({instant}): the instant must be a finite number of seconds")
        loop = self._loop
        when = self._origin + instant
        if when <= loop.time():
            await asyncio.sleep(0)
            return True
        if self._future_at is not None:  # a virtual loop's, at half the price
            await self._future_at(when)
            return True
        future: asyncio.Future[None] = loop.create_future()
        timer = loop.call_at(when, wake, future, None)
        try:
            await future
        finally:
            timer.cancel()
        return True
