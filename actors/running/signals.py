"""SIGINT and SIGTERM: of an event loop, for all the systems in it that ask for them; and of a script whose loop runs in another thread."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable
from typing import Any

__all__ = ["Signals", "SigtermExit", "exit_on_sigterm", "listen"]

Listener = Callable[[signal.Signals], bool]
"""Takes a signal; answers whether it could do anything about it."""


class Signals:
    """The signals of one loop.

    The handlers are installed while there is a listener, and then the program has its own back. Every listener hears every signal. One that
    none of them can do anything about, because everything has stopped and the program goes on regardless, ends the program: by an exception
    out of the loop, or, from the third signal on, at once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._listeners: list[Listener] = []
        self._before: dict[signal.Signals, Any] = {}
        self._handles: dict[signal.Signals, Any] = {}
        """What the program had asked the loop for; uvloop does not tell."""
        self._heard = 0

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Tell `listener` from now on; the returned function ends that. Calling it twice is fine."""
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
            except (NotImplementedError, RuntimeError):  # a platform or a loop without them: KeyboardInterrupt remains
                return
            self._before[number] = before
            if handle is not None:
                self._handles[number] = handle

    def _uninstall(self) -> None:
        for number, before in self._before.items():
            handle = self._handles.get(number)
            if handle is not None:  # the loop's own, for a callback of the program's
                self._loop.add_signal_handler(number, handle._callback, *handle._args)
                continue
            self._loop.remove_signal_handler(number)
            # One of uvloop's would be deaf by now; the default is better.
            if before is not None and getattr(before, "__self__", None) is not self._loop:
                signal.signal(number, before)
        self._before.clear()
        self._handles.clear()

    def _arrived(self, number: signal.Signals) -> None:
        taken = [listener(number) for listener in tuple(self._listeners)]  # each of them is to hear it
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
    """Tell `listener` of SIGINT and SIGTERM as long as `loop` runs, until the returned function is called. In the main thread only."""
    return _signals.setdefault(loop, Signals(loop)).listen(listener)


class SigtermExit:
    """SIGTERM ends the program as Ctrl-C does, through its blocks, with exit code 143.

    One that comes before it is armed waits until then: in between there is a thread that runs, and no block yet that could end it in order.
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
        """Let SIGTERM kill again, unless somebody else has taken the signal since or this is no longer the main thread."""
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) is self:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def exit_on_sigterm() -> SigtermExit | None:
    """Take SIGTERM, unless the program has an answer of its own."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        return None
    handler = SigtermExit()
    signal.signal(signal.SIGTERM, handler)
    return handler
