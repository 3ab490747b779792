"""The timers of `@every` and `Node.create_timer`: ticks on an exact grid, with their lateness measured.

The k-th tick of a timer is due at start + k / hz. This is computed from k, not summed up, so the timer does not drift. The timer's late
policy decides what happens to ticks for which the node is too busy.
"""

from __future__ import annotations

import inspect
from array import array
from collections import deque
from collections.abc import Awaitable, Callable, Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.checks import NoPublicConstructor, is_number
from actors.errors import TickMissed
from actors.inbox.boundary import outside
from actors.runtime.callables import takes_argument

if TYPE_CHECKING:
    from actors.actions.driver import Host
    from actors.inbox.inbox import Inbox
    from actors.parameters import ParameterStore
    from actors.runtime.declarations import Declarations, Late
    from actors.runtime.interceptor import Interceptor
    from actors.runtime.stall import StallWatch
    from actors.time.clock import Clock
    from actors.time.ticker import Ticker, Ticking, TickSource

KEPT = 65536
"""How many measured values of lateness are kept for each timer."""

BACKLOG = 1000
"""The most ticks that wait with ``late="catch_up"``; further ones are lost and counted."""


SHORTEST = 1e-6
"""The shortest period of a timer, seconds: that of the fastest `every`."""


NONE_SEEN: Final = array("d")
"""What a timer has before its first tick."""


class Tick:
    """One tick: `k`, its number from 1, `due`, when it was due, and `late`, how late its handler began; seconds on the event loop's clock.

    Under simulated time `due` and `late` are seconds of ROS time.

    It has no public constructor: a handler of `@every` is given one.
    """

    __slots__ = ("due", "k", "late")

    def __init__(self, k: int, due: float, late: float) -> None:
        self.k = k
        self.due = due
        self.late = late

    def __repr__(self) -> str:
        return f"Tick({self.k}, due={self.due:.6f}, late={self.late:.6f})"


class Lateness:
    """How late the newest 65,536 ticks of one timer began, in seconds.

    Invariants: `_seen` holds at most `KEPT` values; once it is full, `_next` is the index of the oldest one, which the next value replaces.
    """

    __slots__ = ("_next", "_seen")

    def __init__(self) -> None:
        self._seen = NONE_SEEN
        self._next = 0

    def add(self, seconds: float) -> None:
        if self._seen is NONE_SEEN:
            self._seen = array("d")
        if len(self._seen) < KEPT:
            self._seen.append(seconds)
        else:
            self._seen[self._next] = seconds
            self._next = (self._next + 1) % KEPT

    def __len__(self) -> int:
        return len(self._seen)

    def quantiles(self) -> tuple[float, float, float]:
        """Median, 99th percentile and maximum, seconds; zeros before the first tick."""
        if not self._seen:
            return 0.0, 0.0, 0.0
        ordered = sorted(self._seen)
        last = len(ordered) - 1
        return ordered[round(last * 0.5)], ordered[round(last * 0.99)], ordered[last]


class TimerRecord:
    """The figures of one timer, over all incarnations of its node.

    Invariants: `fired`, `overdue`, `missed`, `blocked` and `alive` never fall. `since` is set while the timer ticks; `alive` then holds the seconds
    for which it ticked before `since`.
    """

    __slots__ = ("alive", "blocked", "fired", "hz", "lateness", "latest", "missed", "overdue", "since")

    def __init__(self, hz: float) -> None:
        self.hz = hz
        self.fired = 0
        self.overdue = 0
        """How many of them began a period or more after they were due: caught up, but not on time."""
        self.missed = 0
        self.blocked = 0
        """How many of the missed ticks were lost because the event loop was blocked."""
        self.lateness = Lateness()
        self.alive = 0.0
        self.since: float | None = None
        self.latest = 0.0
        """Loop time at which the newest tick began."""

    def seconds(self, now: float) -> float:
        """For how many seconds the timer has been ticking, at loop time `now`. The wait for a tick that is not due does not count."""
        if self.since is None:
            return self.alive
        return self.alive + max(self.latest - self.since, now - self.since - 1.0 / self.hz, 0.0)

    def rate(self, now: float) -> float:
        """Ticks per second so far; 0 before the first tick."""
        seconds = self.seconds(now)
        return self.fired / seconds if self.fired and seconds > 0.0 else 0.0


Ticked: TypeAlias = Callable[[int, float], None]
"""Takes a tick: its number, and when it was due, seconds on the ticker's clock."""


class NodeTimer:
    """One `@every`, or a run of one `Timer`, in one incarnation. It is itself the inbox item of its waiting tick: a tick makes no object.

    Invariants:

    - While `pending`, and only then, the timer is an item of the inbox, and `k` and `due` are those of the tick that waits there.
    - `backlog` holds the further ticks that wait, in order; it is None unless `late` is "catch_up", and empty unless `pending`.
    - `handle` is set from `begin` to `stop`.
    """

    __slots__ = (
        "backlog", "before", "due", "handle", "handler", "hz", "inbox", "k", "label", "late", "loop_time", "missed", "pending", "period",
        "record", "seen", "takes_tick", "time", "timers",
    )  # fmt: skip

    def __init__(
        self,
        inbox: Inbox,
        handler: Callable[..., Awaitable[None] | None],
        hz: float,
        late: Late,
        label: str,
        record: TimerRecord,
        timers: Timers,
    ) -> None:
        self.inbox = inbox
        self.handler = handler
        self.hz = hz
        self.period = 0.999 / hz  # a little less, since times are rounded; used only to detect missed ticks
        self.late: Late = late
        self.label = label
        self.takes_tick = _takes_argument(handler)
        self.record = record
        self.loop_time = self.time = timers.now
        self.backlog: deque[tuple[int, float]] | None = deque() if late == "catch_up" else None
        self.handle: Ticking | None = None
        self.pending = False
        self.missed = 0
        """How many ticks were lost in this incarnation; the record counts those of all incarnations."""
        self.timers = timers
        """Those that it is one of, which know the interceptors of ticks, and report late ones."""
        self.seen = -1
        self.before = 0
        """How many ticks were delivered before the last change of the rate; `k` counts from there."""
        self.k = 0
        self.due = 0.0

    def __repr__(self) -> str:
        return f"<{self.label} at {self.hz:g} Hz: {self.record.fired} ticks, {self.record.missed} missed>"

    def begin(self, ticker: TickSource, start: float | None = None) -> None:
        """Start ticking. The first tick is due one period from now, or from `start`, seconds on the clock of `ticker`."""
        self.handle = ticker.add(self.hz, self.taker(), start)
        self.record.since = self.loop_time()

    def taker(self) -> Ticked:
        """What a ticker is to call: `on_tick`, behind the node's interceptors. Called once for each ticker."""
        tick: Ticked = self.on_tick
        for each in self.timers.interceptors:
            tick = each.ticking(self, tick)
        return tick

    def stop(self) -> None:
        """End the ticks. Stopping twice is fine."""
        if self.handle is not None:
            self.handle.cancel()
            self.handle = None
            self.record.alive = self.record.seconds(self.loop_time())
            self.record.since = None

    def move(self, handle: Ticking, time: Callable[[], float]) -> None:
        """Take the ticks from `handle`, on a clock that shows `time()`, from now on. A tick that waits counts as due now."""
        self.handle, self.time = handle, time
        self.due = now = time()
        if self.backlog is not None:
            self.backlog = deque((k, now) for k, _ in self.backlog)

    def retime(self, hz: float, ticker: TickSource) -> None:
        """Change the rate: the next tick is due one new period from now. Ticks that wait are kept, and the numbers go on."""
        assert self.handle is not None
        done = self.handle.k
        self.stop()
        self.hz = self.record.hz = hz
        self.period = 0.999 / hz
        self.before += done
        self.k -= done
        if self.backlog is not None:
            self.backlog = deque((k - done, due) for k, due in self.backlog)
        self.begin(ticker)

    def on_tick(self, k: int, due: float) -> None:
        """Called by the ticker: put the tick into the inbox, or apply the late policy if the node or the event loop is late."""
        blocked = self.handle is not None and self.time() >= due + self.period and self._catch_up_with(due)
        if not self.pending:
            self.pending = True
            self.k = k
            self.due = due
            self.seen = self.inbox.handled
            self.inbox.put(self)
            return
        if self.backlog is not None and len(self.backlog) < BACKLOG:
            self.backlog.append((k, due))
        else:
            self._lose(1)
            self.record.blocked += blocked
            if self.backlog is not None and self.handle is not None:  # drop the rest at once instead of one by one
                self._lose(self.handle.skip_missed())
        inbox = self.inbox
        # Nothing was handled since the last tick was put in: one item has held the inbox for a whole period.
        if inbox.current is not None and inbox.handled == self.seen and not blocked:
            inbox.report_holding(inbox.current, 1.0 / self.hz)

    def _catch_up_with(self, due: float) -> bool:
        """Skip the ticks that are due, unless they are to be caught up, since this one is late by a period or more.

        Returns whether the event loop was blocked; under simulated time, where time just made a step, it was not.
        """
        lost = 0
        if self.backlog is None and self.handle is not None:
            lost = self.handle.skip_missed()
            self._lose(lost)
        if self.time is not self.loop_time:
            return False
        self.record.blocked += lost
        self.timers.came_late(self, self.time() - due, lost)
        return True

    def _lose(self, ticks: int) -> None:
        self.missed += ticks
        self.record.missed += ticks

    def run(self) -> Awaitable[None] | None:
        k, due = self.k, self.due
        now = self.record.latest = self.loop_time()
        late = now - due
        if self.time is not self.loop_time:
            late = max(0.0, self.time() - due)  # simulated time may have jumped back since
        self.record.fired += 1
        self.record.lateness.add(late)
        if late >= self.period:
            self.record.overdue += 1
        if self.backlog:
            self.k, self.due = self.backlog.popleft()
            self.inbox.put(self)
        else:
            self.pending = False
        if self.missed and self.late == "fault":
            missed, self.missed = (
                self.missed,
                0,
            )  # if `on_error` lets the node go on, each further miss is a fault of its own
            raise TickMissed(
                f"{self.label}: {missed} more tick(s) were due before tick {self.before + k} had begun, {late * 1e3:.1f} ms late"
            )
        return self.handler(Tick(self.before + k, due, late)) if self.takes_tick else self.handler()


def _takes_argument(handler: Callable[..., Any]) -> bool:
    function = getattr(handler, "__func__", handler)
    return _arguments(function) > (1 if function is not handler else 0)


@lru_cache(maxsize=1024)
def _arguments(function: Callable[..., object]) -> int:
    """How many arguments a function takes, `self` included. Cached, since it is the same for all nodes of a class."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    return code.co_argcount if code is not None else 0


class Timers:
    """The timers of one life of a node: those that its class declares by `@every`, and those that it makes while it runs.

    `ticker` gives the ticks until `use` names another source; `stalls` hears of those for which the event loop was late.

    Invariants: all timers tick by the same source, and show the time of its clock.
    """

    __slots__ = ("_host", "_source", "_stalls", "_time", "declared", "interceptors", "made", "now")

    def __init__(
        self, host: Host, ticker: Ticker, stalls: StallWatch | None, interceptors: tuple[Interceptor, ...]
    ) -> None:
        self._host = host
        self._source: TickSource = ticker
        self._stalls = stalls
        self._time: Callable[[], float] | None = None
        self.now: Callable[[], float] = host.inbox.loop.time
        """The event loop's time, seconds: one function for all timers of the node. A journal's loop notes what it says."""
        self.interceptors = interceptors
        self.declared: tuple[NodeTimer, ...] = ()
        """The timers that the class declares, in that order; none while a lifecycle node is inactive."""
        self.made: dict[NodeTimer, None] | None = None
        """The timers that the node has made and not canceled; None before the first."""

    def __iter__(self) -> Iterator[NodeTimer]:
        yield from self.declared
        yield from self.made or ()

    def start(
        self,
        node: object,
        declarations: Declarations,
        parameters: Callable[[], ParameterStore],
        kept: Mapping[str, TimerRecord],
    ) -> dict[str, TimerRecord]:
        """Start the timers that the class of `node` declares. `kept` holds their figures over all earlier lives, by the name of the
        method. Returns those over all lives."""
        records = dict(kept)
        for declared in declarations.timers:
            hz: float = parameters().value(declared.hz) if isinstance(declared.hz, str) else declared.hz
            record = records.get(declared.attribute)
            if record is None:
                record = records[declared.attribute] = TimerRecord(hz)
            record.hz = hz
            handler, label = getattr(node, declared.attribute), declarations.labels[declared.attribute]
            timer = NodeTimer(self._host.inbox, handler, hz, declared.late, label, record, self)
            for each in self.interceptors:  # `takes_tick` is that of the handler itself
                timer.handler = each.invoking(self._host, label, timer.handler)
            self.declared += (timer,)
            self._begin(timer)
        return records

    def _begin(self, timer: NodeTimer) -> None:
        if self._time is not None:
            timer.time = self._time
        timer.begin(self._source)

    def tick(self, hz: float, handler: Callable[..., Awaitable[None] | None], late: Late, label: str) -> NodeTimer:
        """Start a timer that the node makes while it runs. Its figures are its own; the record of the node does not keep them."""
        timer = NodeTimer(self._host.inbox, handler, hz, late, label, TimerRecord(hz), self)
        if self.made is None:
            self.made = {}
        self.made[timer] = None
        self._begin(timer)
        return timer

    def end(self, timer: NodeTimer) -> None:
        """End the ticks of a timer that `tick` has started. Ending twice is harmless."""
        timer.stop()
        assert self.made is not None
        self.made.pop(timer, None)

    def came_late(self, timer: NodeTimer, seconds: float, lost: int) -> None:
        """Report to the stall watch that the event loop was late for a tick by a period or more, with which `lost` ticks were lost."""
        if self._stalls is not None:
            with outside():
                self._stalls.delayed(self._host.fqn, 1.0 / timer.hz, seconds, lost)

    def retime(self, declarations: Declarations, parameter: str, hz: float) -> None:
        """Change the rate of the timers that tick by this parameter, which has been set to `hz`."""
        for declared, timer in zip(declarations.timers, self.declared, strict=False):  # no timers in an inactive node
            if declared.hz == parameter and timer.hz != hz:
                timer.retime(hz, self._source)

    def use(self, source: TickSource, time: Callable[[], float] | None) -> None:
        """Let timers that start from now on tick by `source`, on the clock that shows `time()`; None is the event loop's."""
        self._source, self._time = source, time

    def stop(self) -> None:
        """Stop the timers that the class declares."""
        for timer in self.declared:
            timer.stop()
        self.declared = ()

    def close(self) -> None:
        """Stop all timers, because the life has ended."""
        self.stop()
        for timer in list(self.made or ()):
            self.end(timer)


class _Run:
    """The time between the start of a timer and its end, reset or change of period. A tick that comes later is not the timer's."""

    __slots__ = ("timer",)

    def __init__(self, timer: Timer) -> None:
        self.timer = timer

    def tick(self, tick: Tick) -> Awaitable[None] | None:
        return self.timer.on_tick(self, tick)


class Timer(metaclass=NoPublicConstructor):
    """A timer made at run time: periodic, or with one tick only. Its ticks are handled as those of `every`, one at a time with the
    node's other handlers, in every state of a lifecycle node, until it is canceled or the node ends.

    `period`, in seconds, may be assigned; the next tick is then due one new period later. `fired` is the number of ticks handled.

    It has no public constructor: `Node.create_timer` gives one.
    """

    # Invariants: `_run` and `_ticks` are set from a start to the next cancellation, and None otherwise. `_since` is when the timer was
    # started, or when the tick that was handled last was due, in seconds on the node's clock.

    __slots__ = (
        "_callback",
        "_check_use",
        "_clock_of",
        "_label",
        "_late",
        "_once",
        "_period",
        "_run",
        "_since",
        "_takes_tick",
        "_ticks",
        "_timers",
        "fired",
    )

    def __init__(
        self,
        timers: Timers,
        check_use: Callable[[], None],
        clock_of: Callable[[], Clock],
        callback: Callable[..., Awaitable[None] | None],
        period: float,
        *,
        once: bool,
        late: Late,
        label: str,
        autostart: bool,
    ) -> None:
        self._timers = timers
        self._check_use = check_use
        self._clock_of = clock_of
        self._callback = callback
        self._takes_tick = takes_argument(callback)
        self._period = checked_period(label, period)
        self._once = once
        self._late: Late = late
        self._label = label
        self._run: _Run | None = None
        self._ticks: NodeTimer | None = None
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
        return None if self.canceled else self._period - (self._clock_of().now() - self._since) % self._period

    def cancel(self) -> None:
        """Let no further tick come, not even one that waits already. Canceling twice is harmless."""
        ticks, self._ticks, self._run = self._ticks, None, None
        if ticks is not None:
            self._timers.end(ticks)

    def reset(self) -> None:
        """Start, or start again: the next tick is due one period from now. Raises `Ended` after the end of the node."""
        self.cancel()
        self._check_use()
        run = _Run(self)
        self._ticks = self._timers.tick(1.0 / self._period, run.tick, self._late, self._label)
        self._run = run
        self._since = self._clock_of().now()

    def on_tick(self, run: _Run, tick: Tick) -> Awaitable[None] | None:
        """Handle a tick of `run`; nothing happens if that is over."""
        if run is not self._run:
            return None
        self.fired += 1
        self._since = self._clock_of().now() - tick.late
        if self._once:
            self.cancel()
        return self._callback(tick) if self._takes_tick else self._callback()


class Rate(metaclass=NoPublicConstructor):
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
