"""The signals that ask a program for its end, for the systems of one event loop, and for a script whose event loop runs in another thread.

SIGINT, SIGTERM and SIGHUP are one kind. SIGPIPE stands for the end of the program that reads the output; the signal itself, which a socket
causes as well, is ignored by Python.
"""

from __future__ import annotations

import asyncio
import os
import select
import signal
import stat
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any, Final

from actors.places import line_of
from actors.system import System

ONE_SIGNAL_SECONDS: Final = 0.5
"""Signals that come within so many seconds are one: `timeout` sends SIGTERM twice, a process group gets Ctrl-C and what its shell sends."""
SECOND_SIGNAL_SECONDS: Final = 2.0
"""A second signal within this time, in seconds, kills what is still stopping."""
OUTPUTS: Final = (1, 2)
"""The descriptors of the output."""

Listener = Callable[[signal.Signals], bool]
"""Called with a signal; returns whether it has handled the signal."""


def ending_signals() -> tuple[signal.Signals, ...]:
    """The signals that ask a program for its end: SIGINT, SIGTERM, and SIGHUP unless it is ignored, as `nohup` has it."""
    ignored = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    return (signal.SIGINT, signal.SIGTERM) if ignored else (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Signals:
    """Passes the signals of one event loop to its listeners. Every listener gets every signal; those within `ONE_SIGNAL_SECONDS` are one.

    A signal that no listener handles, because all systems have stopped and the program goes on nevertheless, ends the program: by an
    exception out of the loop, or from the third signal on at once. So does one that comes while the loop hangs, and has not heard an earlier
    one for `ONE_SIGNAL_SECONDS`: at once, with a line that says where it hangs.

    When nobody reads the output any more, the listeners get SIGPIPE, unless there was a signal before, or SIGHUP is ignored. What is written
    from then on is lost without an error.

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
        self._came = self._taken = -ONE_SIGNAL_SECONDS
        """When the last signal came, and when the last one that was passed on did, seconds on the monotonic clock."""
        self._unheard: float | None = None
        """When the first signal came that the loop has not heard yet."""
        self._watched: list[int] = []

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
        for number in ending_signals():
            before = signal.getsignal(number)
            handle = getattr(self._loop, "_signal_handlers", {}).get(number)
            try:
                self._loop.add_signal_handler(number, self._arrived, number)
            except (NotImplementedError, RuntimeError):  # not supported here: KeyboardInterrupt still works
                return
            self._note(number)
            self._before[number] = before
            if handle is not None:
                self._handles[number] = handle
        for output in OUTPUTS:
            self._watch(output)

    def _uninstall(self) -> None:
        for output in self._watched:
            self._loop.remove_reader(output)
        self._watched.clear()
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

    def _note(self, number: signal.Signals) -> None:
        """Have the main thread note a signal when it comes, and not only when the loop turns."""
        for_loop: Any = signal.getsignal(number)

        def note(number: int, frame: FrameType | None) -> None:
            for_loop(number, frame)
            self._noted(signal.Signals(number))

        signal.signal(number, note)

    def _noted(self, number: signal.Signals) -> None:
        self._came = now = time.monotonic()
        if self._unheard is None:
            self._unheard = now
        elif now - self._unheard >= ONE_SIGNAL_SECONDS:
            text = f"ended by {number.name}: the event loop has not turned for {now - self._unheard:.1f} s, at {line_of(threading.get_ident())}"
            with suppress(OSError):
                os.write(2, f"{Path(sys.argv[0]).name}: {text}\n".encode())
            os._exit(128 + number)

    def _arrived(self, number: signal.Signals) -> None:
        self._unheard = None
        if self._came - self._taken < ONE_SIGNAL_SECONDS:
            return
        self._taken = self._came
        self._heard += 1
        if self._pass_on(number):
            return
        self._uninstall()
        if self._heard > 2:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    def _pass_on(self, number: signal.Signals) -> bool:
        taken = [listener(number) for listener in tuple(self._listeners)]  # a list, so that every listener is called
        return any(taken)

    # -- the output ---------------------------------------------------------------------------------------------------------

    def _watch(self, output: int) -> None:
        """Hear of the end of the reader, if this output is a pipe: the selector tells it to one who waits for something to read there."""
        with suppress(OSError, NotImplementedError):  # a closed output, or a loop that watches no pipes
            if stat.S_ISFIFO(os.fstat(output).st_mode):
                self._loop.add_reader(output, self._closed, output)
                self._watched.append(output)

    def _closed(self, output: int) -> None:
        self._loop.remove_reader(output)
        self._watched.remove(output)
        poll = select.poll()
        poll.register(output, 0)
        if not any(happened & select.POLLERR for _, happened in poll.poll(0)):
            return  # a pipe that this program can read as well
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, output)
        os.close(nowhere)
        if not self._heard and signal.SIGHUP in self._before:
            self._heard = 1
            self._pass_on(signal.SIGPIPE)


def interrupt(system: System, number: signal.Signals) -> bool:
    """Handle a signal: the first one stops the system's tree in order, a second one within `SECOND_SIGNAL_SECONDS` kills. False if the tree
    has ended already."""
    tree, now = system.runtime.tree, system.loop.time()
    if tree.root is not None and not tree.running:
        return False
    if tree.signal is not None and now - tree.signal_at < SECOND_SIGNAL_SECONDS:
        system.kill()
        return True
    tree.signal, tree.signal_at, tree.stop_reason = number, now, number.name
    system.log.info("stopping", signal=number.name)
    if tree.supervisor is not None:
        tree.supervisor.stop(number.name)
    return True


_signals: dict[asyncio.AbstractEventLoop, Signals] = {}


def listen(loop: asyncio.AbstractEventLoop, listener: Listener) -> Callable[[], None]:
    """Call `listener` with what asks this program for its end while `loop` runs, until the returned function is called. Main thread only."""
    return _signals.setdefault(loop, Signals(loop)).listen(listener)


class SigtermExit:
    """A handler for SIGTERM and SIGHUP that raises `SystemExit(143)` or 129 in the main thread, so that the program leaves its blocks in order.

    A signal before `arm` takes effect only then: until that moment a thread runs already, but no block that could end it in order. After the
    first one, those within `ONE_SIGNAL_SECONDS` do not cut the end short.

    Invariants: once `_armed`, a signal raises; before, it only sets `_came`. `_replaced` has the signals that it handles.
    """

    def __init__(self) -> None:
        self._armed = False
        self._came: int | None = None
        self._raised = -ONE_SIGNAL_SECONDS
        self._replaced = [number for number in ending_signals() if signal.getsignal(number) == signal.SIG_DFL]
        for number in self._replaced:
            signal.signal(number, self)

    def __call__(self, number: int, frame: object) -> None:
        if not self._armed:
            self._came = number
        elif time.monotonic() - self._raised >= ONE_SIGNAL_SECONDS:
            self._raised = time.monotonic()
            raise SystemExit(128 + number)

    def arm(self) -> None:
        self._armed = True
        if self._came is not None:
            self(self._came, None)

    def leave(self) -> None:
        """Restore the default actions, unless the handler was replaced meanwhile or this is not the main thread."""
        here = threading.current_thread() is threading.main_thread()
        for number in self._replaced:
            if here and signal.getsignal(number) is self:
                signal.signal(number, signal.SIG_DFL)


def exit_on_sigterm() -> SigtermExit | None:
    """Install a `SigtermExit`, if this is the main thread and the program has no handler of its own for SIGTERM; else return None."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        return None
    return SigtermExit()
