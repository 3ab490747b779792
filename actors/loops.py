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
    to the microsecond, and while it runs its thread asks the kernel not to delay timers (timer slack 1 ns instead of
    50 us); threads started meanwhile inherit that. Elsewhere it is asyncio's selector loop unchanged.
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

    class _PreciseSelector(selectors.EpollSelector):
        """Epoll, waited for through `select.select` on the epoll descriptor itself, whose timeout is in microseconds."""

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            if timeout is None or timeout <= 0.0 or self.fileno() >= _FD_SETSIZE:
                return super().select(timeout)
            self._wait(timeout)
            return super().select(0)

        def _wait(self, timeout: float) -> None:
            """Wait for a descriptor, at most `timeout` seconds.

            The kernel may add a thousandth of a wait to it, so a long one leaves its last part to a second, short one.
            """
            epoll = (self.fileno(),)
            if timeout > _LONG:
                end = time.monotonic() + timeout
                if select.select(epoll, (), (), timeout * 0.995)[0]:
                    return
                timeout = max(0.0, end - time.monotonic())
            select.select(epoll, (), (), timeout)

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
