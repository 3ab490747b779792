"""ROS time with its jumps, and the schedule of timers.

Pure state machines that neither wait nor use asyncio. The rules are those of the clock and the timer of rcl. Times are in nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from time import time_ns
from typing import NamedTuple

from actors.checks import NoPublicConstructor, create
from actors.time.values import ClockType, Duration, Time


class ClockChange(StrEnum):
    """The cause of a time jump: simulated time was switched on or off, or the time itself was set."""

    ROS_TIME_NO_CHANGE = "ROS_TIME_NO_CHANGE"
    ROS_TIME_ACTIVATED = "ROS_TIME_ACTIVATED"
    ROS_TIME_DEACTIVATED = "ROS_TIME_DEACTIVATED"
    SYSTEM_TIME_NO_CHANGE = "SYSTEM_TIME_NO_CHANGE"


class TimeJump(NamedTuple):
    """A jump of the clock: its size in nanoseconds (zero if the source changed), and its cause."""

    clock_change: ClockChange
    delta: Duration

    @property
    def source_changed(self) -> bool:
        """Whether simulated time was switched on or off."""
        return self.clock_change in (ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED)


class JumpThreshold:
    """The jumps that a callback is called for. Immutable.

    ``min_forward`` selects jumps forward by at least this (positive, or None), ``min_backward`` jumps back by at least this (negative, or
    None), ``on_clock_change`` changes of the source. Raises ``ValueError`` for a wrong sign or if nothing is selected.
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
        """Whether the callback is called for this jump."""
        if jump.source_changed and self.on_clock_change:
            return True
        delta = jump.delta.nanoseconds
        if delta > 0:
            return self.min_forward is not None and delta >= self.min_forward.nanoseconds
        return delta < 0 and self.min_backward is not None and delta <= self.min_backward.nanoseconds

    def __repr__(self) -> str:
        change = ", source changes" if self.on_clock_change else ""
        return f"JumpThreshold(forward {self.min_forward}, backward {self.min_backward}{change})"


class JumpHandle(metaclass=NoPublicConstructor):
    """A registered jump callback. ``remove()`` removes it; calling that twice is harmless.

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
        """Remove the callback."""
        self._clock.forget(self)


class RosClock:
    """ROS time: system time or, while simulated time is active, the simulated time that was set last.

    ``activate()`` and ``deactivate()`` switch between the two (``use_sim_time``). ``set(ns)`` sets simulated time (a ``/clock`` message);
    while inactive, the value is stored and no callback runs. Before the first ``set``, simulated time is 0. Jump callbacks run in the order
    of registration, ``pre`` before the change is visible and ``post`` after it. Their exceptions are not caught.
    """

    __slots__ = ("_active", "_handles", "_override", "_system")

    def __init__(self, system: Callable[[], int] = time_ns) -> None:
        self._system = system
        self._active = False
        self._override = 0
        self._handles: tuple[JumpHandle, ...] = ()

    @property
    def active(self) -> bool:
        """Whether simulated time is active."""
        return self._active

    def now_ns(self) -> int:
        """The ROS time in nanoseconds."""
        return self._override if self._active else self._system()

    def now(self) -> Time:
        """The ROS time."""
        return Time(nanoseconds=self.now_ns(), clock_type=ClockType.ROS_TIME)

    def activate(self) -> None:
        """Switch to simulated time. Does nothing if it is active already."""
        if not self._active:
            self._switch(ClockChange.ROS_TIME_ACTIVATED, active=True)

    def deactivate(self) -> None:
        """Switch to system time. Does nothing if it is active already."""
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
            Time(nanoseconds=nanoseconds)  # raises for an invalid value
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
        handle = create(JumpHandle, self, threshold, pre, post)
        self._handles = (*self._handles, handle)
        return handle

    def forget(self, handle: JumpHandle) -> None:
        """Remove a jump callback; called by ``handle.remove()``."""
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
    """One call of a timer, in nanoseconds: when it was due, when it came, and the time since the previous call or the start."""

    expected: int
    actual: int
    since_last: int


class TimerGrid:
    """The schedule of a timer: the grid ``start + k * period``, without drift and without bursts.

    Every method is given the time ``now`` in nanoseconds of the timer's clock. After a late call, the next one is due at the first grid
    point strictly after now: whole periods are skipped and the phase is kept. A period of 0 is always due. A new ``period_ns`` is used from
    the next calculation on.
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
        """Nanoseconds until the next call; negative if it is overdue, None if the timer is canceled."""
        return None if self.canceled else self._next - now

    def time_since_last_call(self, now: int) -> int:
        """Nanoseconds since the last call, or since the start."""
        return now - self._last

    def call(self, now: int) -> TimerCall:
        """Record a call, which may be early, and schedule the next. Raises ``TimerCanceled`` if canceled."""
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
        """Let no call be due until ``reset``."""
        self.canceled = True

    def reset(self, now: int) -> None:
        """Start again, even if canceled: the next call is due one period from now."""
        self.canceled = False
        self._next = now + self.period_ns

    def attach(self, clock: RosClock) -> JumpHandle:
        """Follow the jumps of this clock, whose ``now_ns()`` is passed to the other methods.

        After a jump back before the last call, the next call is due one period from the new now. After a change of the source, the rest of
        the period is kept in the new time, unless one of the two clocks is at 0 (not yet known). The first time after that may be a step
        forward from 0 and still lie before the last call, so every step is followed.
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
                # rcl computes now - remaining + period here, which waits for the elapsed part, contrary to its own comment.
                self._next = now + self._remaining
                self._last = self._next - self.period_ns

        threshold = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1))
        return clock.on_jump(threshold, pre=pre, post=post)

    def __repr__(self) -> str:
        state = "canceled" if self.canceled else f"next at {self._next} ns"
        return f"TimerGrid(every {self.period_ns} ns, {state})"
