"""Periodic callbacks on ROS time: the `Ticker` of a node that follows `/clock`, by the timer rules of rcl."""

from __future__ import annotations

from collections.abc import Callable

from actors.time.ros_clock import RosClock, TimerGrid


class SimTick:
    """One periodic callback of a `SimTicker`. Its period is a whole number of nanoseconds, as in ROS 2."""

    __slots__ = ("_grid", "_jumps", "_ticker", "callback", "k", "missed")

    def __init__(self, ticker: SimTicker, grid: TimerGrid, callback: Callable[[int, float], None], k: int) -> None:
        self._ticker = ticker
        self._grid = grid
        self._jumps = grid.attach(ticker.ros)
        self.callback = callback
        self.k = k
        self.missed = 0
        """The number of ticks that the current step of the time has made due, not counting the one being delivered."""

    def __repr__(self) -> str:
        name = getattr(self.callback, "__qualname__", repr(self.callback))
        return f"<SimTick {name}, {self.k} ticks so far, {self._grid!r}>"

    def wait(self, now: int) -> int:
        """Nanoseconds until the next tick; zero or negative if it is due, a very large number if it is canceled."""
        wait = self._grid.time_until_next_call(now)
        return _NEVER if wait is None else wait

    def skip_missed(self) -> int:
        """Drop the ticks that are due besides the one being delivered. Returns their number."""
        missed, self.missed = self.missed, 0
        self.k += missed
        return missed

    def cancel(self) -> None:
        """End the ticks. Calling it twice is harmless."""
        self.skip_missed()
        self._grid.cancel()
        self._jumps.remove()
        self._ticker.remove(self)

    def deliver(self, now: int) -> None:
        """Deliver the ticks that are due at `now`, in nanoseconds, one after another unless the callback skips them."""
        if self.wait(now) > 0:  # the previous tick has canceled it
            return
        period, due = self._grid.period_ns, self._grid.call(now).expected
        self.missed = (now + self.wait(now) - due) // period - 1
        while True:
            self.k += 1
            self.callback(self.k, due / 1e9)
            if not self.missed:
                return
            self.missed -= 1
            due += period


_NEVER = 2**63


class SimTicker:
    """Periodic callbacks on the time of `ros`. Call `deliver` whenever that time has been set.

    The rules are those of rcl's timers. The k-th tick is due at start + k periods. A step over several of them makes them due together.
    After a step back before the last tick, the next one is due one period from the new now. When simulated time is switched on or off, the
    rest of the period is kept.
    """

    def __init__(self, ros: RosClock) -> None:
        self.ros = ros
        self._ticks: list[SimTick] = []

    def __repr__(self) -> str:
        return f"<SimTicker with {len(self._ticks)} periodic callbacks on {self.ros!r}>"

    def add(self, hz: float, callback: Callable[[int, float], None], start: float | None = None, k: int = 0) -> SimTick:
        """Call `callback(k, due)` every 1 / `hz` seconds from `start`, ROS time in seconds, by default now. Ticks are numbered from `k` +
        1."""
        begin = self.ros.now_ns() if start is None else round(start * 1e9)
        tick = SimTick(self, TimerGrid(max(1, round(1e9 / hz)), begin), callback, k)
        self._ticks.append(tick)
        return tick

    def remove(self, tick: SimTick) -> None:
        """Cancel a tick; called by ``tick.cancel()``."""
        if tick in self._ticks:
            self._ticks.remove(tick)

    def deliver(self) -> None:
        """Deliver every tick that is due now, the earliest first."""
        now = self.ros.now_ns()
        for tick in sorted((tick for tick in self._ticks if tick.wait(now) <= 0), key=lambda tick: tick.wait(now)):
            tick.deliver(now)
