"""Signals while a program starts: nothing has to end in order yet, and an import that is cut short by an exception may say anything.

Imported before all else, so it imports next to nothing.
"""

from __future__ import annotations

import atexit
import os
import signal

TYPE_CHECKING = False  # as that of `typing`, which takes a while to import
if TYPE_CHECKING:
    from typing import NoReturn

LONGEST = 3
"""Seconds that what is registered with `atexit` may take; then SIGALRM ends the program."""


def end_at_signals() -> None:
    """From now on SIGINT, SIGTERM and SIGHUP end the program at once and without a word, with exit code 128 and their number.

    What is registered with `atexit` is called before. SIGHUP stays ignored if it is, as by `nohup`. Main thread only.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


def interruptible() -> None:
    """After `end_at_signals`, for work that no event loop watches: Ctrl-C raises KeyboardInterrupt again, and the other signals, and output
    that nobody reads any more, end the program as they end any."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
            if number == signal.SIGPIPE or signal.getsignal(number) is _end:
                signal.signal(number, signal.SIG_DFL)


def _end(number: int, frame: object) -> None:
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)
    signal.alarm(LONGEST)
    leave(128 + number)  # and not `sys.exit`, which would unwind what is being imported


def leave(code: int) -> NoReturn:
    """End the process without the interpreter's own end; what is registered for the end is called."""
    atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage]
    os._exit(code)
