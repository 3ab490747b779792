"""The event loop for real time: asyncio's selector loop, with timers accurate to microseconds where the system allows it."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from typing import Any


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Create an event loop for real time. Pass this function as `loop_factory` to `asyncio.Runner` or `anyio.run`.

    asyncio rounds every wait up to a whole millisecond, the resolution of `epoll_wait`. On Linux this loop waits with a resolution of
    microseconds. It measures how late the system wakes it and asks to be woken that much earlier. While it runs, its thread asks the kernel
    not to delay timers (a timer slack of 1 ns instead of 50 us), which threads started meanwhile inherit. No timer fires early. On other
    systems it is asyncio's selector loop unchanged.
    """
    return _PreciseLoop(_PreciseSelector()) if sys.platform == "linux" else asyncio.SelectorEventLoop()


def waking(loop: asyncio.AbstractEventLoop) -> list[Callable[[], None]]:
    """What this loop calls when it wakes, before all else of that turn; each must be short, and may only schedule what is to be done.

    Of a loop that is not of this module it is a list that nobody calls.
    """
    found: list[Callable[[], None]] = getattr(loop, "waking", [])
    return found


if sys.platform == "linux":
    import select
    import selectors
    import time

    _FD_SETSIZE = 1024
    """`select.select` accepts only descriptors below this."""
    _PR_SET_TIMERSLACK, _PR_GET_TIMERSLACK = 29, 30
    _LONG = 0.010
    """Waits longer than this, in seconds, are made in two parts."""
    _STEP, _MOST = 1e-6, 200e-6
    """The step by which the measured lag grows, and its maximum, in seconds."""

    class _PreciseSelector(selectors.EpollSelector):
        """An epoll selector that waits with `select.select` on the epoll descriptor itself, whose timeout is in microseconds."""

        def __init__(self) -> None:
            super().__init__()
            self.waking: list[Callable[[], None]] = []
            self._lag = 0.0
            """The lateness, in seconds, that three of four waits reach. The next wait is asked to end that much earlier."""

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            if timeout is not None and timeout <= 0.0:
                return super().select(timeout)
            if timeout is None or self.fileno() >= _FD_SETSIZE:
                ready = super().select(timeout)
            else:
                ready = super().select(0) if self._wait(time.monotonic() + timeout, timeout) else []
            for call in self.waking:
                call()
            return ready

        def _wait(self, end: float, timeout: float) -> bool:
            """Wait for a descriptor until `end`, which is `timeout` seconds away. Whether one is ready.

            The kernel may extend a wait by a thousandth of its length, so a long wait is followed by a short one for its last part.
            """
            if timeout > _LONG:
                if self._ready(timeout * 0.995):
                    return True
                timeout = end - time.monotonic()
            if timeout > self._lag:
                if self._ready(timeout - self._lag):
                    return True
                late = time.monotonic() - end + self._lag
                # One step up and three steps down balance when three of four waits are later than the lag.
                self._lag = min(_MOST, self._lag + _STEP) if late > self._lag else max(0.0, self._lag - 3 * _STEP)
            ready = False
            while time.monotonic() < end and not ready:  # it woke a few microseconds early, too few to sleep
                ready = self._ready(0.0)
            return ready

        def _ready(self, timeout: float) -> bool:
            return bool(select.select((self.fileno(),), (), (), timeout)[0])

    class _PreciseLoop(asyncio.SelectorEventLoop):
        # As in asyncio, but without a Python function: it is called very often.
        time = staticmethod(time.monotonic)  # pyright: ignore[reportAssignmentType]

        def __init__(self, selector: _PreciseSelector) -> None:
            super().__init__(selector)
            self.waking = selector.waking

        def _read_from_self(self) -> None:
            # asyncio reads until a call fails because nothing is left. What is left here wakes the loop again.
            asyncios: Any = self
            with suppress(BlockingIOError, InterruptedError):
                asyncios._process_self_data(asyncios._ssock.recv(4096))

        def run_forever(self) -> None:
            with _sharp_timers():
                super().run_forever()

    @contextmanager
    def _sharp_timers() -> Generator[None]:
        """Set the timer slack of this thread to 1 ns inside the block. A system that refuses is left unchanged."""
        import ctypes

        prctl = ctypes.CDLL(None).prctl
        before = prctl(_PR_GET_TIMERSLACK, 0, 0, 0, 0)
        prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
        try:
            yield
        finally:
            prctl(_PR_SET_TIMERSLACK, max(0, before), 0, 0, 0)  # zero restores the default of the system
