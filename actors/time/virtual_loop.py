"""An asyncio event loop on virtual time: when nothing can run, the clock jumps to the next deadline.

A program on this loop is deterministic and never waits for time: an hour of `asyncio.sleep` takes microseconds. Threads, processes and
sockets are real; while a task waits for a thread or a process, virtual time stands still.

`_run_once` is one iteration of asyncio. When its queue of ready callbacks is empty, nothing can run without time passing; that is known,
not guessed from idle time. Guarantees:

* Time never goes back, and moves only when no callback is ready.
* Deadlines within the same nanosecond are one instant and fire in the order in which they were scheduled.
* No timer fires before its deadline. A deadline that has passed counts as now.
* If a timeout scope and a sleep end at the same instant, the one entered first wins: `move_on_after(1)` around `sleep(1)` is cancelled.
* Waiting forever is reported (`Deadlock`, `Livelock`, `Stalled`), with the line at which each task waits.

Not controlled: `time.time`, `time.monotonic`, global random numbers, `uuid4`, and the order of sets, in which anyio cancels the tasks of a
group.
"""

# pyright: reportPrivateUsage=false
# The loop uses protected members of asyncio (`_ready`, `_run_once`, `Handle._cancelled`), which are the same in CPython 3.11, 3.12 and
# 3.13; the tests run on all three. Both `call_at` and `_run_once` can be replaced, because asyncio uses its own timer heap nowhere else,
# except to clear it in `close`.
from __future__ import annotations

import asyncio
import math
import selectors
import time
from asyncio import Future
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextvars import Context
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, TypeVarTuple, cast

from actors.time import deadlock
from actors.time.deadlock import Deadlock, Livelock, Stalled
from actors.time.handles import SoonHandle, Timer, checked_timer, is_dead, run_watched
from actors.time.workers import OutsideWork
from actors.waiting import wake

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")
_Item: TypeAlias = "Future[None] | asyncio.TimerHandle"
Entry: TypeAlias = "tuple[float, int, float, _Item]"
"""A deadline: its instant (rounded to nanoseconds), its order of scheduling, its exact time, and what fires."""

_GRID_END = 2.0**52 * 1e-9
"""The time, in seconds (52 days), up to which floats resolve whole nanoseconds. Later deadlines are not rounded."""


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop whose `time()` is virtual, in seconds, beginning at `start` (finite and not negative).

    Instead of hanging, `run_until_complete` raises `Deadlock`, `Livelock` or `Stalled`. The loop stays usable, so that the runner can
    cancel the tasks and clean up. Use it as `loop_factory` of `asyncio.Runner` or `anyio.run`.
    """

    virtual: bool = True
    """Tells a `Clock` that the time of this loop is virtual."""
    max_spins: int = 100_000
    """The number of iterations without progress of virtual time after which `Livelock` is raised."""
    patience: float = 10.0
    """How many seconds of real time threads, processes and sockets may take before `Stalled` is raised."""
    socket_patience: float = 60.0
    """How many seconds of real time sockets and signals may keep the loop busy at one instant before `Livelock` is raised."""
    watch: Callable[[], None] | None = None
    """Called whenever nothing can run without time passing. An exception ends the run, and it is not called again."""
    wait_for_io: bool = False
    """For live input: wait without limit for sockets and signals when there are no timers, and let them keep the loop busy."""

    if TYPE_CHECKING:
        _ready: deque[Any]  # of asyncio.Handle
        _stopping: bool
        _closed: bool
        _debug: bool
        _selector: selectors.BaseSelector
        _signal_handlers: dict[int, asyncio.Handle]

        def _check_closed(self) -> None: ...
        def _process_events(self, event_list: list[Any]) -> None: ...

    def __init__(self, start: float = 0.0) -> None:
        if not 0.0 <= start < math.inf:
            self._closed = True  # there is nothing to close yet
            raise ValueError(f"VirtualLoop(start={start}): the start must be a finite number of seconds, zero or more")
        self._now = self._instant = float(start)  # the exact time, and its nanosecond
        self._timers: list[Entry] = []
        self._order = 0  # the order of scheduling, which breaks ties
        self._stamps: dict[int, float] = {}  # id of a task: the time of its last step
        self._tidy_after = 1024  # scheduled timers until dead ones are removed
        self._spins = 0
        self._spinning_since = 0.0
        super().__init__()
        self._outside = OutsideWork(self)
        self._jobs, self._anyio = self._outside.jobs, self._outside.anyio
        self._fds: Mapping[int, object] = self._selector._fd_to_key  # type: ignore[attr-defined]  # one descriptor is the loop's own pipe

    def __repr__(self) -> str:
        return f"<{type(self).__name__} at {deadlock.seconds(self._now)} running={self.is_running()} closed={self.is_closed()}>"

    # ---------------------------------------------------------------------------------------- time and timers

    def time(self) -> float:
        """Virtual seconds. Constant while anything is ready to run."""
        return self._now

    def call_at(
        self, when: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call `callback(*args)` at the virtual time `when`. Infinity means never; NaN is refused."""
        made = checked_timer if self._debug or self._closed else Timer
        timer = made(when, callback, args, self, context)
        self._push(when, timer)
        return timer

    def call_later(
        self, delay: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call `callback(*args)` after `delay` virtual seconds, rounded to a whole nanosecond so that delays add up exactly."""
        now = self._now
        when = now + delay
        if when < _GRID_END and (instant := int(when * 1e9 + 0.5) / 1e9) > now:
            when = instant
        made = checked_timer if self._debug or self._closed else Timer
        timer = made(when, callback, args, self, context)
        self._push(when, timer)
        return timer

    @property
    def idle(self) -> bool:
        """Whether nothing more can run at this instant."""
        return not self._ready

    @property
    def progress(self) -> object:
        """Return a value that differs from earlier ones if the loop has made an iteration since. Callable from any thread."""
        return self._now, self._order, self._spins

    def last_step(self, task: asyncio.Task[object] | None, default: float) -> float:
        """When a task last ran, in virtual seconds; `default` if that is not known."""
        return self._stamps.get(id(task), default)

    @property
    def stands_still(self) -> bool:
        """Whether virtual time waits for a thread or a process."""
        return bool(self._outside.names())

    def sleep_until(self, when: float) -> Future[None]:
        """Return a future that is done at the virtual time `when`. Awaiting it costs half as much as `asyncio.sleep`."""
        if self._closed:
            self._check_closed()
        future: Future[None] = Future(loop=self)
        if self._now <= when < _GRID_END:  # `_push`, inlined
            self._order = order = self._order + 1
            heappush(self._timers, (int(when * 1e9 + 0.5) / 1e9, order, when, future))
        else:
            self._push(when, future)
        return future

    def advance_to(self, when: float) -> bool:
        """Move time to `when` if nothing can happen before or at it, otherwise change nothing. Returns whether it moved.

        For a callback with many deadlines of its own (`actors.time.ticker.Ticker`), which saves a return to the loop between two of them.
        """
        timers = self._timers
        if self._ready or self._stopping or self._debug or when < self._now:
            return False
        if (timers and timers[0][0] <= when) or self._watching():
            return False
        self._now = self._instant = when
        return True

    def call_soon(
        self, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.Handle:
        """Do what asyncio does, in fewer steps."""
        if self._debug or self._closed:
            return super().call_soon(callback, *args, context=context)
        handle = SoonHandle(callback, args, self, context)
        self._ready.append(handle)
        return handle

    def _push(self, when: float, item: _Item) -> None:
        if self._now <= when < _GRID_END:
            instant = int(when * 1e9 + 0.5) / 1e9  # like round(when, 9), in half the time
        elif when < self._now:
            instant = self._instant
        elif when < math.inf:
            instant = when
        elif when == math.inf:
            return
        else:
            raise ValueError("a deadline must be a number of seconds, not NaN")
        self._order = order = self._order + 1
        heappush(self._timers, (instant, order, when, item))

    def _tidy(self) -> None:
        """Remove dead timers and the stamps of dead tasks, so that canceled timers take no memory in a long run."""
        timers = self._timers
        timers[:] = [entry for entry in timers if not is_dead(entry[3])]
        heapify(timers)
        alive = {id(task) for task in asyncio.all_tasks(self)}
        self._stamps = {key: stamp for key, stamp in self._stamps.items() if key in alive}
        self._tidy_after = self._order + 2 * (len(timers) + len(alive)) + 1024

    # ---------------------------------------------------------------------------------------- one iteration

    def _run_once(self) -> None:
        ready = self._ready
        if ready or self._stopping:
            self._spins += 1
            if not self._spins & 15:
                self._spin()
            if self._timers and self._timers[0][0] <= self._instant:
                self._join()
        elif (self._jobs or self._anyio or len(self._fds) > 1 or self._signal_handlers) and self._attend():
            pass
        else:
            self._jump()
        stamps, now, debug = self._stamps, self._now, self._debug
        for _ in range(len(ready)):
            handle = ready.popleft()
            if handle._cancelled:
                continue
            callback = handle._callback
            stamps[id(getattr(callback, "__self__", None))] = now
            if debug:
                run_watched(self, handle)
                continue
            try:
                handle._context.run(callback, *handle._args)
            except (SystemExit, KeyboardInterrupt):
                raise
            except BaseException as error:
                self._failed(handle, error)
        # An error that is kept refers to this frame, and the callback perhaps to the error's task.
        handle = callback = None

    def _jump(self) -> None:
        """Move time to the next live deadline and fire what is due then, in the order of scheduling.

        Timers that these schedule for the same instant wait for the next iteration, as in asyncio.
        """
        if (watch := self.watch) is not None:
            self.watch = None
            watch()
            self.watch = watch
        timers, last, limit = self._timers, self._order, math.inf
        if last > self._tidy_after:
            self._tidy()
        if self._spins > self.max_spins:
            self._judge_spinning()
        while timers and timers[0][0] <= limit and timers[0][1] <= last:
            instant, _, when, item = heappop(timers)
            if item.done() if isinstance(item, Future) else item._cancelled:  # `is_dead`, inlined
                continue
            if instant > self._instant:
                self._instant = instant
                self._spins = 0
            elif limit == math.inf:  # due again at an instant that has already begun
                self._spins += 1
            limit = instant
            if when < instant:
                when = instant
            if when > self._now:  # `when` may be a fraction of a nanosecond after `instant`; nothing fires early
                self._now = when
            if isinstance(item, Future):
                item.set_result(None)
            else:
                self._fire(item)
        if limit == math.inf:
            self._wait_without_timers()

    def _fire(self, timer: Any) -> None:
        if self._debug:
            run_watched(self, timer)
            return
        try:
            timer._context.run(timer._callback, *timer._args)
        except (SystemExit, KeyboardInterrupt):
            raise
        except BaseException as error:
            self._failed(timer, error)

    def _failed(self, handle: asyncio.Handle, error: BaseException) -> None:
        message = f"Exception in callback {handle!r}"
        self.call_exception_handler({"message": message, "exception": error, "handle": handle})

    def _spin(self) -> None:
        """At every 16th iteration at one instant: poll for I/O, and decide whether this is a livelock."""
        if self._spins > self.max_spins:
            self._judge_spinning()
        elif self._watching():
            self._hear()

    def _join(self) -> None:
        """Append the timers that are due now to the callbacks that are ready."""
        timers = self._timers
        while timers and timers[0][0] <= self._instant:
            _, _, when, item = heappop(timers)
            self._now = max(self._now, when)
            if isinstance(item, Future):
                self.call_soon(wake, item, None)
            else:
                self._ready.append(item)

    # ---------------------------------------------------------------------------------------- the outside world

    def run_in_executor(self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts) -> Future[_T]:
        """Do what asyncio does. Virtual time stands still until the future is completed or canceled."""
        future = super().run_in_executor(executor, func, *args)
        self._outside.add_thread(future, func)
        return future

    async def shutdown_default_executor(self, *args: object) -> None:
        """Do what asyncio does. Virtual time stands still while the threads are joined."""
        with self._outside.during("shutdown of the default executor"):
            await super().shutdown_default_executor(*args)

    async def _make_subprocess_transport(self, *args: object, **kwargs: object) -> asyncio.SubprocessTransport:
        with self._outside.during("start of a process"):
            made = await super()._make_subprocess_transport(*args, **kwargs)  # type: ignore[misc]  # not in typeshed
        transport = cast("asyncio.SubprocessTransport", made)
        self._outside.add_process(transport)
        return transport

    def close(self) -> None:
        """Do what asyncio does."""
        super().close()
        self._timers.clear()
        self._stamps.clear()

    def _watching(self) -> bool:
        """Whether anything but a timer could make a callback ready."""
        return len(self._fds) > 1 or bool(self._signal_handlers) or self._outside.possible()

    def _poll(self, timeout: float | None) -> bool:
        """Accept input from outside, waiting for it for `timeout` seconds of real time. Returns whether there was any."""
        events = self._selector.select(timeout)
        self._process_events(events)
        return bool(events)

    def _hear(self) -> bool:
        """Accept the input that is there, which is progress. Sockets that always have more do not hold one instant for ever."""
        if not self._poll(0):
            return False
        self._spins = 0
        limit = self.socket_patience
        if self._outside.input_lasts(self._instant, limit) and not self.wait_for_io:
            reason = f"Sockets or signals have kept the loop busy for {limit:g} real seconds at one instant"
            raise Livelock(self._news(reason, deadlock.BUSY_SOCKETS))
        return True

    def _attend(self) -> bool:
        """Accept input from outside when nothing is ready. Returns whether virtual time has to stand still for outside work."""
        if not self._watching():
            return False
        if self._hear():
            return True
        if not (work := self._outside.names()):
            return False
        if not self._poll(self.patience):
            raise Stalled(self._news(self._silence(work), deadlock.STALLED))
        return True

    def _wait_without_timers(self) -> None:
        if self._poll(0) or self._ready:  # a thread unknown to the loop has called in
            return
        if self.wait_for_io:
            self._poll(None)
        elif not self._watching():
            raise Deadlock(self._news("Nothing is left that could wake a task", deadlock.DEADLOCK))
        elif not self._poll(self.patience):
            reason = f"No timer is left, and no socket or signal woke a task within {self.patience} real seconds"
            raise Stalled(self._news(reason, deadlock.NO_INPUT))

    def _judge_spinning(self) -> None:
        """Raise `Livelock` after `max_spins` iterations at one instant, unless a task polls for outside work."""
        if not (work := self._outside.names()):
            spins, self._spins = self._spins, 0  # the loop is still needed for the clean-up
            reason = f"{spins} iterations of the loop without progress of virtual time"
            raise Livelock(self._news(reason, deadlock.LIVELOCK))
        if self._spins - self.max_spins <= 16:
            self._spinning_since = time.perf_counter()
        if self._poll(0.001):
            self._spins = 0
        elif time.perf_counter() - self._spinning_since > self.patience:
            self._spins = 0
            raise Stalled(self._news(self._silence(work), deadlock.STALLED))

    def _silence(self, work: list[str]) -> str:
        return f"No news within {self.patience} real seconds from: {'; '.join(work)}"

    def _news(self, reason: str, remedy: str) -> str:
        handles = [*self._ready, *(entry[3] for entry in self._timers[:1] if entry[0] <= self._instant)]
        return deadlock.report(reason, self._now, asyncio.all_tasks(self), self._stamps, handles, remedy)
