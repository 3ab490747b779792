"""An asyncio event loop on virtual time: when nothing can run, the clock jumps onto the next deadline."""

# pyright: reportPrivateUsage=false
from __future__ import annotations

import asyncio
import contextlib
import heapq
import math
import selectors
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextvars import Context
from typing import TYPE_CHECKING, Any

__all__ = ["Deadlock", "Livelock", "Stalled", "VirtualLoop"]


class Deadlock(RuntimeError):
    """Every task is parked, and no timer, thread, process or socket can ever wake one."""


class Livelock(RuntimeError):
    """Callbacks keep rescheduling each other while virtual time stands still."""


class Stalled(RuntimeError):
    """Outside work (a thread, a process, a socket) did not report back within `VirtualLoop.patience` real seconds."""


class VirtualLoop(asyncio.SelectorEventLoop):
    """Event loop whose `time()` is virtual, in seconds from `start`."""

    max_spins: int = 100_000
    patience: float = 10.0
    wait_for_io: bool = False

    if TYPE_CHECKING:
        _ready: deque[asyncio.Handle]
        _stopping: bool
        _selector: selectors.BaseSelector
        _check_closed: Callable[[], None]
        _process_events: Callable[[list[Any]], None]

    def __init__(self, start: float = 0.0) -> None:
        self._now = float(start)
        self._timers: list[tuple[float, int, asyncio.TimerHandle]] = []
        self._timer_count = 0
        self._spins = 0
        self._outside: dict[object, str] = {}
        super().__init__()
        self._own_fds = len(self._selector.get_map())

    def time(self) -> float:
        return self._now

    def call_later(
        self, delay: float, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        return self.call_at(self._now + delay, callback, *args, context=context)

    def call_at(
        self, when: float, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        self._check_closed()
        timer = asyncio.TimerHandle(when, callback, args, self, context)
        if when != math.inf:  # an infinite deadline is no deadline
            self._timer_count += 1
            heapq.heappush(self._timers, (round(when, 9), self._timer_count, timer))
            timer._scheduled = True  # type: ignore[attr-defined]
        return timer

    @contextlib.contextmanager
    def frozen(self, reason: str) -> Iterator[None]:
        key = object()
        self._outside[key] = reason
        try:
            yield
        finally:
            del self._outside[key]

    def run_in_executor(self, executor: Any, func: Callable[..., Any], *args: Any) -> Any:
        future = super().run_in_executor(executor, func, *args)
        self._outside[future] = f"thread running {getattr(func, '__qualname__', func)}"
        future.add_done_callback(lambda done: self._outside.pop(done, None))
        return future

    async def shutdown_default_executor(self, *args: Any) -> None:
        with self.frozen("shutdown of the default executor"):
            await super().shutdown_default_executor(*args)

    async def _make_subprocess_transport(self, *args: Any, **kwargs: Any) -> Any:
        with self.frozen("start of a subprocess"):
            transport = await super()._make_subprocess_transport(*args, **kwargs)  # type: ignore[misc]
            if transport.get_returncode() is None:
                self._outside[transport] = f"process {transport.get_pid()}"
            return transport

    def _child_watcher_callback(self, pid: int, returncode: int, transp: Any) -> None:
        super()._child_watcher_callback(pid, returncode, transp)  # type: ignore[misc]
        self.call_soon_threadsafe(self.call_soon, lambda: self._outside.pop(transp, None))

    def close(self) -> None:
        super().close()
        self._timers.clear()

    def _run_once(self) -> None:
        if self._ready or self._stopping:
            self._spin()
        else:
            self._quiet()
        self._fire_due()
        for _ in range(len(self._ready)):
            handle = self._ready.popleft()
            if not handle._cancelled:
                handle._run()

    def _fire_due(self) -> None:
        timers, ready = self._timers, self._ready
        while timers and timers[0][0] <= self._now:
            timer = heapq.heappop(timers)[2]
            timer._scheduled = False  # type: ignore[attr-defined]
            self._now = max(self._now, timer.when())
            ready.append(timer)

    def _spin(self) -> None:
        self._spins += 1
        if self._spins & 15 == 0:
            self._poll(0)
        if self._spins > self.max_spins and not self._work():
            self._spins = 0
            raise Livelock(
                f"{self.max_spins} loop iterations while virtual time stood still at {self._now!r} s. Next: "
                + ", ".join(map(repr, list(self._ready)[:5]))
            )

    def _quiet(self) -> None:
        self._spins = 0
        if self._poll(0):
            return
        while self._timers and self._timers[0][2]._cancelled:
            heapq.heappop(self._timers)
        if work := self._work():
            if not self._poll(self.patience):
                raise Stalled(f"no news within {self.patience} real seconds from: {'; '.join(work)}")
        elif self._timers:
            self._now = max(self._now, self._timers[0][0])
        elif self.wait_for_io:
            self._poll(None)
        elif len(self._selector.get_map()) > self._own_fds:
            if not self._poll(self.patience):
                raise Stalled(f"only a socket can wake these tasks, and none did: {asyncio.all_tasks(self)}")
        else:
            raise Deadlock(f"nothing can ever wake these tasks: {asyncio.all_tasks(self)}")

    def _poll(self, timeout: float | None) -> bool:
        events = self._selector.select(timeout)
        self._process_events(events)
        return bool(events) or bool(self._ready)

    def _work(self) -> list[str]:
        names = sorted(self._outside.values())
        for thread in threading.enumerate():
            if thread.name == "AnyIO worker thread" and thread.loop is self and thread not in thread.idle_workers:  # type: ignore[attr-defined]
                names.append("anyio worker thread")
        return names
