"""SIGINT and SIGTERM, for the systems of one event loop, and for a script whose event loop runs in another thread."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable
from typing import Any

__all__ = ["Signals", "SigtermExit", "exit_on_sigterm", "listen"]

Listener = Callable[[signal.Signals], bool]
"""Called with a signal; returns whether it has handled the signal."""


class Signals:
    """Passes the signals of one event loop to its listeners. Every listener gets every signal.

    A signal that no listener handles, because all systems have stopped and the program goes on nevertheless, ends the program: by an
    exception out of the loop, or from the third signal on at once.

    Invariants: while there is a listener, `_before` holds the handlers that the program had before, and those of this class are installed,
    if the platform and the loop support that. Without a listener the program's own handlers are installed.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._listeners: list[Listener] = []
        self._before: dict[signal.Signals, Any] = {}
        self._handles: dict[signal.Signals, Any] = {}
        """The handlers that the program had added to the loop; those of uvloop cannot be found."""
        self._heard = 0

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` with every signal, until the returned function is called. Calling that twice is fine."""
        self._listeners.append(listener)
        self._install()

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
                if not self._listeners:
                    self._uninstall()
                    _signals.pop(self._loop, None)

        return leave

    def _install(self) -> None:
        if self._before:
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            before = signal.getsignal(number)
            handle = getattr(self._loop, "_signal_handlers", {}).get(number)
            try:
                self._loop.add_signal_handler(number, self._arrived, number)
            except (NotImplementedError, RuntimeError):  # not supported here: KeyboardInterrupt still works
                return
            self._before[number] = before
            if handle is not None:
                self._handles[number] = handle

    def _uninstall(self) -> None:
        for number, before in self._before.items():
            handle = self._handles.get(number)
            if handle is not None:  # the program had added a callback to the loop: add it again
                self._loop.add_signal_handler(number, handle._callback, *handle._args)
                continue
            self._loop.remove_signal_handler(number)
            # A handler of uvloop itself would not work any more; the default is better.
            if before is not None and getattr(before, "__self__", None) is not self._loop:
                signal.signal(number, before)
        self._before.clear()
        self._handles.clear()

    def _arrived(self, number: signal.Signals) -> None:
        taken = [listener(number) for listener in tuple(self._listeners)]  # a list, so that every listener is called
        self._heard += 1
        if any(taken):
            return
        self._uninstall()
        if self._heard > 2:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)


_signals: dict[asyncio.AbstractEventLoop, Signals] = {}


def listen(loop: asyncio.AbstractEventLoop, listener: Listener) -> Callable[[], None]:
    """Call `listener` with every SIGINT and SIGTERM while `loop` runs, until the returned function is called. Main thread only."""
    return _signals.setdefault(loop, Signals(loop)).listen(listener)


class SigtermExit:
    """A handler for SIGTERM that raises `SystemExit(143)` in the main thread, so that the program leaves its blocks in order.

    A signal before `arm` takes effect only then: until that moment a thread runs already, but no block that could end it in order.

    Invariants: once `_armed`, every signal raises; before, it only sets `_came`.
    """

    def __init__(self) -> None:
        self._armed = self._came = False

    def __call__(self, number: int, frame: object) -> None:
        if self._armed:
            raise SystemExit(128 + number)
        self._came = True

    def arm(self) -> None:
        self._armed = True
        if self._came:
            raise SystemExit(128 + signal.SIGTERM)

    def leave(self) -> None:
        """Restore the default action of SIGTERM, unless the handler was replaced meanwhile or this is not the main thread."""
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) is self:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def exit_on_sigterm() -> SigtermExit | None:
    """Install a `SigtermExit`, if this is the main thread and the program has no handler of its own; else return None."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        return None
    handler = SigtermExit()
    signal.signal(signal.SIGTERM, handler)
    return handler
