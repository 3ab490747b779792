"""Timers that a node makes while it runs, and `Rate`. Those of a node's class are declared by `every`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any, Protocol

from actors.checks import is_number
from actors.runtime.callables import takes_argument

if TYPE_CHECKING:
    from actors.runtime.declarations import Late
    from actors.time.clock import Clock

__all__ = ["Rate", "RunningTimer", "Timer", "TimerSource", "checked_period"]

SHORTEST = 1e-6
"""The shortest period of a timer, seconds: that of the fastest `every`."""


class RunningTimer(Protocol):
    """The ticks of one timer, as it uses them; implemented by `actors.runtime.timers.NodeTimer`."""

    @property
    def missed(self) -> int:
        """How many ticks were lost."""
        ...


class TimerSource(Protocol):
    """An incarnation, as a timer uses it."""

    clock: Clock

    def tick(
        self, hz: float, handler: Callable[..., Awaitable[None] | None], late: Late, label: str
    ) -> RunningTimer: ...
    def end_ticks(self, timer: Any) -> None: ...


class _Run:
    """The time between the start of a timer and its end, reset or change of period. A tick that comes later is not the timer's."""

    __slots__ = ("timer",)

    def __init__(self, timer: Timer) -> None:
        self.timer = timer

    def tick(self, tick: Any) -> Awaitable[None] | None:
        return self.timer.on_tick(self, tick)


class Timer:
    """A timer made at run time: periodic, or with one tick only. Its ticks are handled as those of `every`, one at a time with the
    node's other handlers, in every state of a lifecycle node, until it is canceled or the node ends.

    `period`, in seconds, may be assigned; the next tick is then due one new period later. `fired` is the number of ticks handled.

    It has no public constructor: `Node.create_timer` gives one.
    """

    # Invariants: `_run` and `_ticks` are set from a start to the next cancellation, and None otherwise. `_since` is when the timer was
    # started, or when the tick that was handled last was due, in seconds on the node's clock.

    __slots__ = (
        "_callback",
        "_label",
        "_late",
        "_life",
        "_once",
        "_period",
        "_run",
        "_since",
        "_takes_tick",
        "_ticks",
        "fired",
    )

    def __init__(
        self,
        life: TimerSource,
        callback: Callable[..., Awaitable[None] | None],
        period: float,
        *,
        once: bool,
        late: Late,
        label: str,
        autostart: bool,
    ) -> None:
        self._life = life
        self._callback = callback
        self._takes_tick = takes_argument(callback)
        self._period = checked_period(label, period)
        self._once = once
        self._late: Late = late
        self._label = label
        self._run: _Run | None = None
        self._ticks: RunningTimer | None = None
        self._since = 0.0
        self.fired = 0
        if autostart:
            self.reset()

    def __repr__(self) -> str:
        state = "canceled" if self.canceled else f"every {self._period:g} s" if not self._once else "once"
        return f"<timer {self._label}, {state}: {self.fired} ticks>"

    @property
    def canceled(self) -> bool:
        """Whether no tick will come: it was canceled, or never started, or was to tick once and has."""
        return self._run is None

    @property
    def period(self) -> float:
        return self._period

    @period.setter
    def period(self, seconds: float) -> None:
        self._period = checked_period(self._label, seconds)
        if not self.canceled:
            self.reset()

    @property
    def missed(self) -> int:
        """How many ticks were lost since the last start, because the node was busy."""
        return 0 if self._ticks is None else self._ticks.missed

    @property
    def remaining(self) -> float | None:
        """The time until the next tick is due, in seconds on the node's clock; None if the timer is canceled."""
        return None if self.canceled else self._period - (self._life.clock.now() - self._since) % self._period

    def cancel(self) -> None:
        """Let no further tick come, not even one that waits already. Canceling twice is harmless."""
        ticks, self._ticks, self._run = self._ticks, None, None
        if ticks is not None:
            self._life.end_ticks(ticks)

    def reset(self) -> None:
        """Start, or start again: the next tick is due one period from now. Raises `Ended` after the end of the node."""
        self.cancel()
        run = _Run(self)
        self._ticks = self._life.tick(1.0 / self._period, run.tick, self._late, self._label)
        self._run = run
        self._since = self._life.clock.now()

    def on_tick(self, run: _Run, tick: Any) -> Awaitable[None] | None:
        """Handle a tick of `run`; nothing happens if that is over."""
        if run is not self._run:
            return None
        self.fired += 1
        self._since = self._life.clock.now() - tick.late
        if self._once:
            self.cancel()
        return self._callback(tick) if self._takes_tick else self._callback()


class Rate:
    """Keeps a loop at a rate: ``while True: ...; await rate.sleep()``.

    Its instants lie one period apart on the node's clock, from the moment in which it was made. One that has passed is left out. A
    `sleep` that begins after simulated time has jumped back takes at most one period of it.

    It has no public constructor: `Node.create_rate` gives one.
    """

    # Invariant: `_last` is the number of the instant that `sleep` waited for last, 0 before the first.

    __slots__ = ("_clock_of", "_last", "_period_ns", "_start_ns", "period")

    def __init__(self, clock_of: Callable[[], Clock], hz: float) -> None:
        if not is_number(hz) or not 0 < hz <= 1 / SHORTEST:
            raise ValueError(f"a rate of {hz!r:.40} Hz: it must be more than 0 and at most {1 / SHORTEST:g}")
        self.period = 1.0 / hz
        """Seconds."""
        self._clock_of = clock_of
        self._period_ns = max(1, round(1e9 / hz))
        self._start_ns = clock_of().now_ns()
        self._last = 0

    def __repr__(self) -> str:
        return f"<rate of {1.0 / self.period:g} Hz>"

    async def sleep(self) -> None:
        """Wait until the next instant of the grid."""
        clock = self._clock_of()
        passed = (clock.now_ns() - self._start_ns) // self._period_ns
        if passed < self._last - 1:
            self._last = passed
        self._last = max(passed, self._last) + 1
        await clock.sleep_until((self._start_ns + self._last * self._period_ns) / 1e9)


def checked_period(label: str, seconds: float) -> float:
    """The period of a timer. Raises `ValueError` for what is no number of seconds that a timer can tick at."""
    if not is_number(seconds) or not SHORTEST <= seconds <= 1e9:
        raise ValueError(f"{label}: a period of {seconds!r:.40} s; it must be a number of seconds from {SHORTEST:g} on")
    return float(seconds)
