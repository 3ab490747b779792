"""One thread for calls that may wait, so that the loop never does."""

from __future__ import annotations

import asyncio
import atexit
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from typing import Final, TypeVar

T = TypeVar("T")

_LAST: Final = 3.0
"""Seconds for which the process, at its end, waits for the calls of closed workers."""
_ending: Final[set[threading.Thread]] = set()
"""Threads of workers that are closed and not yet done."""


@atexit.register
def _wait() -> None:
    # A daemon thread that comes back to Python from native code while the interpreter ends is unwound by force, and Zenoh's frames do not
    # allow that: the process would abort, with "FATAL: exception not rethrown".
    for thread in tuple(_ending):
        thread.join(_LAST)


class Worker:
    """A thread that makes calls one after the other, in the order in which they were handed over.

    Invariants: there is a thread exactly between construction and `close`; it is a daemon, so that a call that never returns does not keep
    the process alive.
    """

    def __init__(self, name: str) -> None:
        self._calls: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def do(self, call: Callable[[], None]) -> None:
        """Have `call` made. It should not raise: an error is reported as that of a thread, and the worker goes on."""
        self._calls.put(call)

    async def result(self, call: Callable[[], T]) -> T:
        """Have `call` made, and wait for what it returns or raises. If the waiting is cancelled, the call is made nevertheless."""
        loop = asyncio.get_running_loop()
        future: asyncio.Future[T] = loop.create_future()

        def settle(result: T | None, error: BaseException | None) -> None:
            if future.cancelled():
                return
            if error is not None:
                future.set_exception(error)
            else:
                future.set_result(result)  # type: ignore[arg-type]

        def make() -> None:
            try:
                outcome: tuple[T | None, BaseException | None] = call(), None
            except BaseException as error:  # of any kind: the caller that waits gets it
                outcome = None, error
            with suppress(RuntimeError):  # the loop has been closed: the caller was cancelled, and is gone
                loop.call_soon_threadsafe(settle, *outcome)

        self._calls.put(make)
        return await future

    def close(self) -> None:
        """End the thread after the calls that it has. Waits for none of them; the end of the process does, for some seconds."""
        _ending.add(self._thread)
        self._calls.put(None)

    def join(self) -> None:
        """Wait until the thread has ended, after `close`. Not for the loop's thread."""
        self._thread.join()

    def _work(self) -> None:
        while (call := self._calls.get()) is not None:
            try:
                call()
            except BaseException:
                # Also a panic in a native library: else nothing would be sent any more, and a close would not end.
                threading.excepthook(threading.ExceptHookArgs((*sys.exc_info(), self._thread)))
        _ending.discard(self._thread)
