"""The event loop for the real clock: asyncio's own, with timers of microseconds where the system allows it."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Generator
from contextlib import contextmanager

__all__ = ["new_event_loop"]


def new_event_loop() -> asyncio.AbstractEventLoop:
    """A selector event loop for real time; pass it as `loop_factory` to `asyncio.Runner` or `anyio.run`.

    asyncio rounds every wait up to a whole millisecond, because `epoll_wait` takes no less. On Linux this loop waits
    to the microsecond, learns by how much the system wakes it late and asks that much earlier, and while it runs its
    thread asks the kernel not to delay timers (timer slack 1 ns instead of 50 us); threads started meanwhile inherit
    that. No timer fires early. Elsewhere it is asyncio's selector loop unchanged.
    """
    return _PreciseLoop(_PreciseSelector()) if sys.platform == "linux" else asyncio.SelectorEventLoop()


if sys.platform == "linux":
    import select
    import selectors
    import time

    _FD_SETSIZE = 1024
    """Descriptors that `select.select` can take are below this."""
    _PR_SET_TIMERSLACK, _PR_GET_TIMERSLACK = 29, 30
    _LONG = 0.010
    """Seconds; longer waits are made in two parts."""
    _STEP, _MOST = 1e-6, 200e-6
    """By how much the learned lag grows after a wait that ended later than it, and the most it may become, seconds."""

    class _PreciseSelector(selectors.EpollSelector):
        """Epoll, waited for through `select.select` on the epoll descriptor itself, whose timeout is in microseconds."""

        def __init__(self) -> None:
            super().__init__()
            self._lag = 0.0
            """The lateness, in seconds, that three of four waits reach: the next wait is asked to end that much earlier."""

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            if timeout is None or timeout <= 0.0 or self.fileno() >= _FD_SETSIZE:
                return super().select(timeout)
            self._wait(time.monotonic() + timeout, timeout)
            return super().select(0)

        def _wait(self, end: float, timeout: float) -> None:
            """Wait for a descriptor, at most until `end`, which is `timeout` seconds away.

            The kernel may add a thousandth of a wait to it, so a long one leaves its last part to a second, short one.
            """
            if timeout > _LONG:
                if self._ready(timeout * 0.995):
                    return
                timeout = end - time.monotonic()
            if timeout > self._lag:
                if self._ready(timeout - self._lag):
                    return
                late = time.monotonic() - end + self._lag
                # A rise of one step to a fall of three settles where three of four are later.
                self._lag = min(_MOST, self._lag + _STEP) if late > self._lag else max(0.0, self._lag - 3 * _STEP)
            while time.monotonic() < end and not self._ready(0.0):
                pass  # it woke early: a few microseconds are left, too few to sleep for

        def _ready(self, timeout: float) -> bool:
            return bool(select.select((self.fileno(),), (), (), timeout)[0])

    class _PreciseLoop(asyncio.SelectorEventLoop):
        # As asyncio has it, but without a Python call: everything asks for it.
        time = staticmethod(time.monotonic)  # pyright: ignore[reportAssignmentType]

        def run_forever(self) -> None:
            with _sharp_timers():
                super().run_forever()

    @contextmanager
    def _sharp_timers() -> Generator[None]:
        """Set the timer slack of this thread to 1 ns inside the block; a system that refuses is left as it is."""
        import ctypes

        prctl = ctypes.CDLL(None).prctl
        before = prctl(_PR_GET_TIMERSLACK, 0, 0, 0, 0)
        prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
        try:
            yield
        finally:
            prctl(_PR_SET_TIMERSLACK, max(0, before), 0, 0, 0)  # zero stands for the system's default
