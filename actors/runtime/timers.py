"""Periodic handlers: ticks on an exact grid, their lateness measured.

The k-th tick of a timer is due at start + k / hz, computed, never added up, so it does not drift. What happens to ticks that the node
is too busy for is the timer's late policy.
"""

from __future__ import annotations

import inspect
from array import array
from collections import deque
from collections.abc import Awaitable, Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Protocol

from actors.errors import ActorError

if TYPE_CHECKING:
    from actors.inbox.inbox import Inbox
    from actors.node.declarations import Late
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.stall import StallWatch

__all__ = [
    "Lateness",
    "NodeTimer",
    "Tick",
    "TickMissed",
    "TickSource",
    "Ticking",
    "TimerRecord",
    "retime",
    "start_timers",
]

KEPT = 65536

BACKLOG = 1000
"""With ``late="catch_up"`` at most so many ticks wait; a node that is too slow for ever loses the rest, and that is counted."""


class TickMissed(ActorError):
    """A timer with ``late="fault"`` was due while its last tick had not begun."""


class Ticking(Protocol):
    """What delivers the ticks of one timer: a `TickHandle`, or under simulated time a `SimTick`."""

    k: int
    """The number of the last tick."""

    def skip_missed(self) -> int:
        """Drop the ticks that are due already and not delivered. Returns how many."""
        ...

    def cancel(self) -> None:
        """No more ticks."""
        ...


class TickSource(Protocol):
    """A `Ticker` or a `SimTicker`."""

    def add(self, hz: float, callback: Callable[[int, float], None], start: float | None = None) -> Ticking: ...


class Tick:
    """One tick: its number from 1, when it was due and by how much it began late, seconds on the event loop's clock.

    Under simulated time both are seconds of ROS time.

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
    """How late the ticks of one timer began: the newest 65,536 of them, seconds."""

    __slots__ = ("_next", "_seen")

    def __init__(self) -> None:
        self._seen = array("d")
        self._next = 0

    def add(self, seconds: float) -> None:
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
    """What is known of one timer over all incarnations of its node."""

    __slots__ = ("alive", "blocked", "fired", "hz", "lateness", "latest", "missed", "since")

    def __init__(self, hz: float) -> None:
        self.hz = hz
        self.fired = 0
        self.missed = 0
        self.blocked = 0
        """How many of the missed ticks a blocked event loop has cost."""
        self.lateness = Lateness()
        self.alive = 0.0
        self.since: float | None = None
        self.latest = 0.0
        """Loop time at which the newest tick began."""

    def seconds(self, now: float) -> float:
        """For how long the timer has been ticking, at loop time `now`. The wait for a tick that is not due yet does not count."""
        if self.since is None:
            return self.alive
        return self.alive + max(self.latest - self.since, now - self.since - 1.0 / self.hz, 0.0)

    def rate(self, now: float) -> float:
        """Ticks per second so far; 0 before the first."""
        seconds = self.seconds(now)
        return self.fired / seconds if self.fired and seconds > 0.0 else 0.0


class NodeTimer:
    """One `@every` of one incarnation; as an inbox item it is its waiting tick."""

    __slots__ = (
        "backlog", "before", "due", "handle", "handler", "hz", "inbox", "k", "label", "late", "loop_time", "missed", "on_late", "pending", "period",
        "record", "seen", "takes_tick", "time",
    )  # fmt: skip

    def __init__(
        self,
        inbox: Inbox,
        handler: Callable[..., Awaitable[None] | None],
        hz: float,
        late: Late,
        label: str,
        record: TimerRecord,
        on_late: Callable[[NodeTimer, float, int], None] | None = None,
    ) -> None:
        self.inbox = inbox
        self.handler = handler
        self.hz = hz
        self.period = 0.999 / hz  # a little less, as times are rounded: it only asks whether ticks may have been missed
        self.late: Late = late
        self.label = label
        self.takes_tick = _takes_argument(handler)
        self.record = record
        self.loop_time = self.time = inbox.loop.time
        self.backlog: deque[tuple[int, float]] | None = deque() if late == "catch_up" else None
        self.handle: Ticking | None = None
        self.pending = False
        self.missed = 0
        """Ticks lost in this incarnation; the record counts those of all."""
        self.on_late = on_late
        """Hears that the event loop was late for a tick by a period or more: by how many seconds, and how many ticks that has cost."""
        self.seen = -1
        self.before = 0
        """Ticks delivered before the last change of the rate; `k` counts from there."""
        self.k = 0
        self.due = 0.0

    def __repr__(self) -> str:
        return f"<{self.label} at {self.hz:g} Hz: {self.record.fired} ticks, {self.record.missed} missed>"

    def begin(self, ticker: TickSource, start: float | None = None) -> None:
        """Start ticking; the first tick is due one period from now (or from the loop time `start`)."""
        self.handle = ticker.add(self.hz, self.on_tick, start)
        self.record.since = self.loop_time()

    def stop(self) -> None:
        """No more ticks. Stopping twice is fine."""
        if self.handle is not None:
            self.handle.cancel()
            self.handle = None
            self.record.alive = self.record.seconds(self.loop_time())
            self.record.since = None

    def move(self, handle: Ticking, time: Callable[[], float]) -> None:
        """Tick by `handle`, on a clock that shows `time()`, from now on. A tick that waits counts as due now."""
        self.handle, self.time = handle, time
        self.due = now = time()
        if self.backlog is not None:
            self.backlog = deque((k, now) for k, _ in self.backlog)

    def retime(self, hz: float, ticker: TickSource) -> None:
        """Tick at another rate: the next tick is due one new period from now. Ticks that wait stay, and all are counted on."""
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
        """The ticker's call: put this tick into the inbox, or, if the node or the loop is late, apply the late policy."""
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
            if self.backlog is not None and self.handle is not None:  # the rest would be lost one by one
                self._lose(self.handle.skip_missed())
        inbox = self.inbox
        if (
            inbox.current is not None and inbox.handled == self.seen and not blocked
        ):  # one and the same item for a whole period
            inbox.report_holding(inbox.current, 1.0 / self.hz)

    def _catch_up_with(self, due: float) -> bool:
        """Ticks are late by periods: one tick now, then back onto the grid, unless `late` says otherwise. Whether the event loop was blocked."""
        lost = 0
        if self.backlog is None and self.handle is not None:
            lost = self.handle.skip_missed()
            self._lose(lost)
        if self.time is not self.loop_time:  # simulated time has made a step
            return False
        self.record.blocked += lost
        if self.on_late is not None:
            self.on_late(self, self.time() - due, lost)
        return True

    def _lose(self, ticks: int) -> None:
        self.missed += ticks
        self.record.missed += ticks

    def run(self) -> Awaitable[None] | None:
        k, due = self.k, self.due
        now = self.record.latest = self.loop_time()
        late = now - due
        if self.time is not self.loop_time:
            late = max(0.0, self.time() - due)  # simulated time may have gone back since
        self.record.fired += 1
        self.record.lateness.add(late)
        if self.missed and self.late == "fault":
            raise TickMissed(
                f"{self.label}: {self.missed} more tick(s) were due before tick {self.before + k} had begun, {late * 1e3:.1f} ms late"
            )
        if self.backlog:
            self.k, self.due = self.backlog.popleft()
            self.inbox.put(self)
        else:
            self.pending = False
        return self.handler(Tick(self.before + k, due, late)) if self.takes_tick else self.handler()


def _takes_argument(handler: Callable[..., Any]) -> bool:
    function = getattr(handler, "__func__", handler)
    return _arguments(function) > (1 if function is not handler else 0)


@lru_cache(maxsize=1024)
def _arguments(function: Callable[..., Any]) -> int:
    """How many arguments a function takes, self included; the same for all nodes of a class."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    return code.co_argcount if code is not None else 0


def start_timers(life: Incarnation) -> None:
    """Let every `@every` of the node's class tick from now on."""
    node, labels, runtime = life.node, life.declarations.labels, life.runtime
    on_late = None if runtime.stalls is None else partial(_tell_late, runtime.stalls, life.fqn)
    for declared in life.declarations.timers:
        hz = life.parameters.value(declared.hz) if isinstance(declared.hz, str) else declared.hz
        record = life.record.timers.get(declared.attribute)
        if record is None:
            record = life.record.timers[declared.attribute] = TimerRecord(hz)
        record.hz = hz
        handler, label = getattr(node, declared.attribute), labels[declared.attribute]
        timer = NodeTimer(life.inbox, handler, hz, declared.late, label, record, on_late)
        life.timers.append(timer)
        if life.sim is None:
            timer.begin(runtime.ticker)
        else:
            life.sim.begin(timer)


def _tell_late(stalls: StallWatch, node: str, timer: NodeTimer, seconds: float, lost: int) -> None:
    """The event loop was late for a tick by a period or more: see who held it up."""
    stalls.delayed(node, 1.0 / timer.hz, seconds, lost)


def retime(life: Incarnation, name: str, hz: float) -> None:
    """The parameter `name` has been set: what ticks by it ticks at the new rate from now on."""
    ticker: TickSource = life.runtime.ticker
    if life.sim is not None and life.sim.ros.active:
        ticker = life.sim.ticker
    for declared, timer in zip(life.declarations.timers, life.timers, strict=False):  # none while they rest
        if declared.hz == name and timer.hz != hz:
            timer.retime(hz, ticker)
