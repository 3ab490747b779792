"""Simulated time: a node whose parameter `use_sim_time` is true follows the time that is published on `/clock`.

The parameter may be given at the node's start or set at run time, as in ROS 2. From then on `self.clock` shows the time of the newest
message, 0 before the first one, and stands still when no message comes. Stamps, `self.clock.sleep()`, `sleep_until()` and `@every` follow
it. Each node has its own clock. Timeouts of calls, goals and streams, QoS deadlines, lifespans and leases stay on the event loop's clock,
so that a paused simulation makes nothing wait for ever; so do the times of log lines and the rates of timers in reports.

When time jumps, or its source changes:

* A jump forward over several ticks of a timer makes them all due; the timer's late policy decides what happens to them.
* After a jump back to before a timer's last tick the next tick is due one period after the new time. A shorter jump back moves no tick.
* When `use_sim_time` is switched, a timer waits for the rest of its period on the other clock.
* A sleep ends when its instant is reached, and returns True. If simulated time is switched off meanwhile, or the node ends, it ends at once
  and returns False. A sleep that began on the system's clock ends on that clock.

`Node.on_jump` registers callbacks for jumps. Nodes that do not use simulated time do not pay for it.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from actors import qos
from actors.checks import create
from actors.contracts.contracts import Topic
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.time.clock import Clock
from actors.time.ros_clock import JumpHandle, JumpThreshold, RosClock, TimeJump
from actors.time.sim_ticker import SimTick, SimTicker
from actors.time.ticker import TickHandle
from actors.time.values import nanoseconds_of
from actors.topics.stream import StreamSubscription
from actors.waiting import wake

if TYPE_CHECKING:
    from actors.actions.driver import Host
    from actors.graph.graph import TopicEntry
    from actors.inbox.expiring import ExpiringMessage
    from actors.runtime.timers import NodeTimer, Timers
    from actors.time.ticker import Ticker
    from actors.topics.peers import Participant

CLOCK: Final = Topic(ClockMessage, "/clock", qos.CLOCK)
"""The topic that carries simulated time: best effort, keep_last 1."""


class SimClock(Clock):
    """The clock of a node that uses or has used simulated time: it shows the time of `/clock` while that is switched on, else the system's.

    Under simulated time `now()` and `wall()` are the same seconds, as precise as a float; `now_ns()`, `wall_ns()` and `stamp()` are exact.
    The time stands still and jumps, also back, with the messages on `/clock`.

    Invariants: `_sleepers` holds the futures of the sleeps that have not ended, each with its instant in nanoseconds of simulated time.
    After `close` no sleep on simulated time waits.
    """

    __slots__ = ("_closed", "_ros", "_sleepers", "_system")

    def __init__(self, ros: RosClock, system: Clock, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(loop, virtual=system.virtual)
        self._ros = ros
        self._system = system
        self._closed = False
        self._sleepers: dict[asyncio.Future[bool], int] = {}

    def __repr__(self) -> str:
        return f"<simulated clock at {self.now():.6f} s>" if self._ros.active else repr(self._system)

    def now(self) -> float:
        """Seconds of simulated time; while it is switched off, seconds since the system started."""
        return self._ros.now_ns() / 1e9 if self._ros.active else self._system.now()

    def now_ns(self) -> int:
        return self._ros.now_ns() if self._ros.active else self._system.now_ns()

    def wall(self) -> float:
        """Seconds of simulated time; while it is switched off, the system's time of day."""
        return self._ros.now_ns() / 1e9

    def wall_ns(self) -> int:
        return self._ros.now_ns()

    def wall_ns_at(self, now: float) -> int:
        return round(now * 1e9) if self._ros.active else self._system.wall_ns_at(now)

    def shift_wall(self, seconds: float) -> None:
        """Move the system's time of day by `seconds`. Simulated time is set by `/clock` only."""
        self._system.shift_wall(seconds)

    def loop_time(self, now: float) -> float:
        """As `Clock.loop_time`. Raises `RuntimeError` under simulated time, which cannot be converted to loop time."""
        if self._ros.active:
            raise RuntimeError(f"nobody knows when {self!r} will show {now} s: await sleep_until() instead")
        return self._system.loop_time(now)

    def call_at(self, instant: float, callback: Callable[[], object]) -> asyncio.TimerHandle | asyncio.Future[bool]:
        if not self._ros.active:
            return self._system.call_at(instant, callback)

        def over(future: asyncio.Future[bool]) -> None:
            self._sleepers.pop(future, None)
            if not future.cancelled():
                callback()

        future: asyncio.Future[bool] = self._loop.create_future()
        future.add_done_callback(over)
        self._sleepers[future] = _nanoseconds(instant)
        return future

    async def sleep(self, seconds: float) -> bool:
        if not self._ros.active or not math.isfinite(seconds):
            return await self._system.sleep(seconds)
        return await self._wait(self._ros.now_ns() + _nanoseconds(seconds))

    async def sleep_until(self, instant: float) -> bool:
        if not self._ros.active or not math.isfinite(instant):
            return await self._system.sleep_until(instant)
        return await self._wait(_nanoseconds(instant))

    async def _wait(self, instant: int) -> bool:
        reached = instant <= self._ros.now_ns()
        if reached or self._closed:
            await asyncio.sleep(0)
            return reached
        future: asyncio.Future[bool] = self._loop.create_future()
        self._sleepers[future] = instant
        try:
            return await future
        finally:
            self._sleepers.pop(future, None)

    def wake(self) -> None:
        """End the sleeps whose instant is reached, the earliest first. To be called when time has been set."""
        now = self._ros.now_ns()
        due = [(instant, future) for future, instant in self._sleepers.items() if instant <= now]
        for _, future in sorted(due, key=lambda sleeper: sleeper[0]):
            wake(future, True)

    def wake_all(self) -> None:
        """End all sleeps with False. To be called when simulated time has been switched off."""
        for future in self._sleepers:
            wake(future, False)

    def close(self) -> None:
        """End all sleeps, and from now on every new one, with False, because the node has ended."""
        self._closed = True
        self.wake_all()


def _nanoseconds(seconds: float) -> int:
    return round(min(seconds, _FAR) * 1e9)


_FAR: Final = 1e10
"""A time, in seconds, later than any that a `/clock` message can hold."""


class ClockSubscription(StreamSubscription[ClockMessage]):
    """A subscription without a queue: time is set at the moment of publication, not when the node has its turn."""

    __slots__ = ("_step",)

    def __init__(
        self,
        node: Participant,
        entry: TopicEntry,
        step: Callable[[ClockMessage], None],
        on_close: Callable[[StreamSubscription[ClockMessage]], None],
    ) -> None:
        super().__init__(node, entry, CLOCK.type, CLOCK.qos, on_close)
        self._step = step

    def deliver(self, message: ClockMessage) -> None:
        self.received += 1
        self.latest = message
        self._step(message)

    def wrapped(self, expiring: ExpiringMessage[ClockMessage]) -> ClockMessage:
        return expiring.message


class SimTime:
    """The ROS time of one life of a node, from its first use to the end of the life.

    `system` and `ticker` are those of the system; `follow` subscribes a function to `/clock`.

    Invariants: until the life ends, `_subscription` is set and `ros.active` is true exactly while simulated time is switched on;
    every timer of the life ticks by `ticker` then, and by the system's ticker otherwise.
    """

    __slots__ = (
        "_ended",
        "_follow",
        "_host",
        "_loop",
        "_subscription",
        "_system_ticker",
        "_timers",
        "_warned",
        "clock",
        "ros",
        "ticker",
    )

    def __init__(
        self,
        host: Host,
        system: Clock,
        ticker: Ticker,
        timers: Timers,
        follow: Callable[[Callable[[ClockMessage], None]], ClockSubscription],
    ) -> None:
        self._host = host
        self._loop = host.inbox.loop
        self._system_ticker = ticker
        self._timers = timers
        self._follow = follow
        self._subscription: ClockSubscription | None = None
        self._ended = self._warned = False
        self.ros = RosClock(system.wall_ns)
        self.clock = create(SimClock, self.ros, system, self._loop)
        self.ticker = SimTicker(self.ros)

    def __repr__(self) -> str:
        return f"<ROS time of {self._host.fqn}: {self.ros!r}>"

    def use(self, simulated: bool) -> None:
        """Switch simulated time on or off, as setting `use_sim_time` does. Nothing happens if it is so already, or the node has ended."""
        if simulated is not self.ros.active and not self._ended:
            if simulated:
                self._on()
            else:
                self._off()

    def close(self) -> None:
        """End all sleeps, because the life has ended."""
        self._ended = True
        self.clock.close()

    def on_jump(
        self,
        threshold: JumpThreshold,
        pre: Callable[[], object] | None,
        post: Callable[[TimeJump], object] | None,
    ) -> JumpHandle:
        """As `RosClock.on_jump`, but the exception of a callback is this node's failure, not an error of the publisher of the time."""

        def guarded(callback: Callable[..., object] | None, *arguments: TimeJump) -> None:
            try:
                if callback is not None:
                    callback(*arguments)
            except Exception as error:
                self._host.fail(error, "jump callback")

        return self.ros.on_jump(threshold, pre=lambda: guarded(pre), post=lambda jump: guarded(post, jump))

    # -- the switch ---------------------------------------------------------------------------------------------------------

    def _on(self) -> None:
        self._subscription = self._follow(self._step)
        moving = [(timer, self._taken(timer)) for timer in self._timers]
        self.ros.activate()
        self._timers.use(self.ticker, self.clock.now)
        for timer, tick in moving:
            timer.move(tick, self.clock.now)
        self.ticker.deliver()

    def _off(self) -> None:
        assert self._subscription is not None
        self._subscription.close()
        self._subscription = None
        self.ros.deactivate()
        self._timers.use(self._system_ticker, None)
        self.clock.wake_all()
        for timer in self._timers:
            self._give_back(timer)

    def _taken(self, timer: NodeTimer) -> SimTick:
        """Move a timer from the loop's clock to simulated time. Must be called before the switch, which keeps the rest of the period."""
        handle = timer.handle
        assert isinstance(handle, TickHandle)
        last = self.ros.now_ns() - round((self._loop.time() - (handle.start + handle.k / handle.hz)) * 1e9)
        handle.cancel()
        return self.ticker.add(timer.hz, timer.taker(), last / 1e9, handle.k)

    def _give_back(self, timer: NodeTimer) -> None:
        """Move a timer back to the loop's clock; it waits for the rest of its period."""
        tick = timer.handle
        assert isinstance(tick, SimTick)
        wait = max(0, tick.wait(self.ros.now_ns()))
        tick.cancel()
        handle = self._system_ticker.add(timer.hz, timer.taker(), self._loop.time() + wait / 1e9 - 1.0 / timer.hz)
        handle.start -= tick.k / timer.hz  # the numbers of its ticks go on
        handle.k = tick.k
        timer.move(handle, timer.loop_time)

    # -- the time -----------------------------------------------------------------------------------------------------------

    def _step(self, message: ClockMessage) -> None:
        stamp = message.clock
        nanoseconds = nanoseconds_of(stamp)
        if nanoseconds < 0:
            if not self._warned:
                self._warned = True
                self._host.warn("time before 0 on /clock: ignored", sec=stamp.sec, nanosec=stamp.nanosec)
            return
        self.ros.set(nanoseconds)
        if self.ros.active:  # a jump callback may have switched it off
            self.clock.wake()
            self.ticker.deliver()
