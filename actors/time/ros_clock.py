"""ROS time with its jumps, and the grid that timers run on.

Pure state machines: nothing here waits or knows of asyncio. Rules: the clock and the timer of rcl. Numbers are
nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from time import time_ns
from typing import NamedTuple

from actors.time.values import ClockType, Duration, Time

__all__ = [
    "ClockChange",
    "JumpHandle",
    "JumpThreshold",
    "RosClock",
    "TimeJump",
    "TimerCall",
    "TimerCanceled",
    "TimerGrid",
]


class ClockChange(StrEnum):
    """How a time jump came about: simulated time was switched on or off, or the time itself was set."""

    ROS_TIME_NO_CHANGE = "ROS_TIME_NO_CHANGE"
    ROS_TIME_ACTIVATED = "ROS_TIME_ACTIVATED"
    ROS_TIME_DEACTIVATED = "ROS_TIME_DEACTIVATED"
    SYSTEM_TIME_NO_CHANGE = "SYSTEM_TIME_NO_CHANGE"


class TimeJump(NamedTuple):
    """A step of the clock: by how much (zero when the source changed), and whether its source changed."""

    clock_change: ClockChange
    delta: Duration

    @property
    def source_changed(self) -> bool:
        """Whether simulated time was switched on or off."""
        return self.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)


class JumpThreshold:
    """Which jumps a callback wants to hear of. Immutable.

    ``min_forward``: steps forward of at least this (positive, or None); ``min_backward``: steps back of at least this
    (negative, or None); ``on_clock_change``: changes of the source. Wrong signs, or nothing at all: ``ValueError``.
    """

    __slots__ = ("min_backward", "min_forward", "on_clock_change")

    def __init__(
        self, *, min_forward: Duration | None, min_backward: Duration | None, on_clock_change: bool = True
    ) -> None:
        if min_forward is not None and min_forward.nanoseconds <= 0:
            raise ValueError(f"min_forward must be positive or None, not {min_forward!r}")
        if min_backward is not None and min_backward.nanoseconds >= 0:
            raise ValueError(f"min_backward must be negative or None, not {min_backward!r}")
        if min_forward is None and min_backward is None and not on_clock_change:
            raise ValueError("this threshold never fires; give min_forward, min_backward or on_clock_change=True")
        self.min_forward = min_forward
        self.min_backward = min_backward
        self.on_clock_change = on_clock_change

    def passed_by(self, jump: TimeJump) -> bool:
        """Whether this jump is one to report."""
        if jump.source_changed and self.on_clock_change:
            return True
        delta = jump.delta.nanoseconds
        if delta > 0:
            return self.min_forward is not None and delta >= self.min_forward.nanoseconds
        return delta < 0 and self.min_backward is not None and delta <= self.min_backward.nanoseconds

    def __repr__(self) -> str:
        change = ", source changes" if self.on_clock_change else ""
        return f"JumpThreshold(forward {self.min_forward}, backward {self.min_backward}{change})"


class JumpHandle:
    """A registered jump callback; ``remove()`` ends it, twice is harmless.

    It has no public constructor: `Node.on_jump` gives one.
    """

    __slots__ = ("_clock", "post", "pre", "threshold")

    def __init__(
        self,
        clock: RosClock,
        threshold: JumpThreshold,
        pre: Callable[[], object] | None,
        post: Callable[[TimeJump], object] | None,
    ) -> None:
        self._clock = clock
        self.threshold = threshold
        self.pre = pre
        self.post = post

    def remove(self) -> None:
        """Stop the callbacks."""
        self._clock.forget(self)


class RosClock:
    """ROS time: system time, or, while simulated time is active, the time that was last set.

    ``activate()`` and ``deactivate()`` switch (``use_sim_time``), ``set(ns)`` stores a new simulated time (a ``/clock``
    message); set while inactive, it is kept and reported by nobody. Before the first ``set``, active time is 0.
    Jump callbacks run around the change, ``pre`` before it is visible, ``post`` after it, in order of registration;
    what a callback raises leaves the method.
    """

    __slots__ = ("_active", "_handles", "_override", "_system")

    def __init__(self, system: Callable[[], int] = time_ns) -> None:
        self._system = system
        self._active = False
        self._override = 0
        self._handles: tuple[JumpHandle, ...] = ()

    @property
    def active(self) -> bool:
        """Whether simulated time is in force."""
        return self._active

    def now_ns(self) -> int:
        """The ROS time in nanoseconds."""
        return self._override if self._active else self._system()

    def now(self) -> Time:
        """The ROS time."""
        return Time(nanoseconds=self.now_ns(), clock_type=ClockType.ROS_TIME)

    def activate(self) -> None:
        """Switch to simulated time. No change, no callbacks, if it is active already."""
        if not self._active:
            self._switch(ClockChange.ROS_TIME_ACTIVATED, active=True)

    def deactivate(self) -> None:
        """Switch to system time. No change, no callbacks, if it is in force already."""
        if self._active:
            self._switch(ClockChange.ROS_TIME_DEACTIVATED, active=False)

    def _switch(self, change: ClockChange, *, active: bool) -> None:
        jump = TimeJump(change, Duration())
        told = self._before(jump)
        self._active = active
        self._after(jump, told)

    def set(self, nanoseconds: int) -> None:
        """Set simulated time. Raises ``ValueError`` below zero and ``OverflowError`` beyond int64."""
        if not 0 <= nanoseconds < 2**63:
            Time(nanoseconds=nanoseconds)  # says what is wrong with it
        if not self._active or not self._handles:
            self._override = nanoseconds
            return
        jump = TimeJump(ClockChange.ROS_TIME_NO_CHANGE, Duration(nanoseconds=nanoseconds - self._override))
        told = self._before(jump)
        self._override = nanoseconds
        self._after(jump, told)

    def on_jump(
        self,
        threshold: JumpThreshold,
        *,
        pre: Callable[[], object] | None = None,
        post: Callable[[TimeJump], object] | None = None,
    ) -> JumpHandle:
        """Call ``pre()`` before and ``post(jump)`` after every jump that passes the threshold."""
        handle = JumpHandle(self, threshold, pre, post)
        self._handles = (*self._handles, handle)
        return handle

    def forget(self, handle: JumpHandle) -> None:
        """Remove a jump callback, for ``handle.remove()``."""
        self._handles = tuple(one for one in self._handles if one is not handle)

    def _before(self, jump: TimeJump) -> tuple[JumpHandle, ...]:
        told = tuple(handle for handle in self._handles if handle.threshold.passed_by(jump))
        for handle in told:
            if handle.pre is not None:
                handle.pre()
        return told

    def _after(self, jump: TimeJump, told: tuple[JumpHandle, ...]) -> None:
        for handle in told:
            if handle.post is not None:
                handle.post(jump)

    def __repr__(self) -> str:
        return f"RosClock({self.now()!r}, {'simulated' if self._active else 'system'} time)"


# Timers -------------------------------------------------------------------------------------------------------------


class TimerCanceled(RuntimeError):
    """A canceled timer was called; ``reset`` it first."""


class TimerCall(NamedTuple):
    """One call of a timer, in ns: when it was due, when it came, and how long after the call (or start) before it."""

    expected: int
    actual: int
    since_last: int


class TimerGrid:
    """When a timer is due: the grid ``start + k * period``, without drift and without bursts.

    Pure: every method is told the time ``now`` in nanoseconds of its clock. A late call moves the plan to the first
    grid point strictly after now, so whole periods are skipped and the phase is kept. Period 0 is always due. A new
    ``period_ns`` counts from the next computation on.
    """

    __slots__ = ("_last", "_next", "_remaining", "canceled", "period_ns")

    def __init__(self, period_ns: int, now: int, *, autostart: bool = True) -> None:
        if period_ns < 0:
            raise ValueError(f"a timer's period must not be negative: {period_ns} ns")
        self.period_ns = period_ns
        self.canceled = not autostart
        self._last = now
        self._next = now + period_ns
        self._remaining = 0

    def ready(self, now: int) -> bool:
        """Whether a call is due."""
        return not self.canceled and self._next <= now

    def time_until_next_call(self, now: int) -> int | None:
        """Nanoseconds to the next call, negative when it is overdue, None when canceled."""
        return None if self.canceled else self._next - now

    def time_since_last_call(self, now: int) -> int:
        """Nanoseconds since the last call, or since the start."""
        return now - self._last

    def call(self, now: int) -> TimerCall:
        """Account for a call, early ones too, and plan the next. Raises ``TimerCanceled`` when canceled."""
        if self.canceled:
            raise TimerCanceled("this timer is canceled; reset() it before it is called again")
        call = TimerCall(self._next, now, now - self._last)
        self._last = now
        self._next += self.period_ns
        if self.period_ns == 0:
            self._next = now
        elif self._next <= now:
            self._next += ((now - self._next) // self.period_ns + 1) * self.period_ns
        return call

    def cancel(self) -> None:
        """Never due until ``reset``."""
        self.canceled = True

    def reset(self, now: int) -> None:
        """Start anew: next call one period from now, also when canceled."""
        self.canceled = False
        self._next = now + self.period_ns

    def attach(self, clock: RosClock) -> JumpHandle:
        """Follow the jumps of this clock, whose ``now_ns()`` the other methods are given.

        Back before the last call: next call one period from the new now. A change of the source: the timer waits the
        rest of its period in the new time, unless one of the two clocks stands at 0 (not yet known). The first time
        after that may be a step forward from 0 and still lie before the last call, so it hears of every step.
        """

        def pre() -> None:
            now = clock.now_ns()
            self._remaining = self._next - now if now else 0

        def post(jump: TimeJump) -> None:
            now = clock.now_ns()
            if not jump.source_changed:
                if now < self._last:
                    self._last = now
                    self._next = now + self.period_ns
            elif now and self._remaining:
                # rcl plans now - remaining + period here, which waits the elapsed part; its comment says otherwise
                self._next = now + self._remaining
                self._last = self._next - self.period_ns

        threshold = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1))
        return clock.on_jump(threshold, pre=pre, post=post)

    def __repr__(self) -> str:
        state = "canceled" if self.canceled else f"next at {self._next} ns"
        return f"TimerGrid(every {self.period_ns} ns, {state})"
