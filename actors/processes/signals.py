"""The signals that a process of a tree leaves to its parent.

Ctrl-C, a closed terminal, `timeout` and service managers send them to all processes of a group at once. The tree can end in order only if
the processes wait for their turn.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import Final

PARENT: Final = signal.SIGUSR1
"""The signal by which the parent asks for the end, and the system tells that the parent has ended."""
_PR_SET_PDEATHSIG: Final = 1
_LEFT: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def held_back() -> Generator[None, None, None]:
    """A process that this thread starts within the block begins with these signals blocked, until it calls `leave_to_parent`. A signal for
    this thread waits for the end of the block."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _LEFT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def leave_to_parent() -> None:
    """Do nothing at these signals from now on. Programs that this process starts take them as usual, except for SIGINT. Main thread only."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` has it
            signal.signal(number, _nothing)
            signal.siginterrupt(number, False)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _LEFT)


def _nothing(number: int, frame: object) -> None:
    """A handler, unlike SIG_IGN, is not inherited by programs that this process starts."""


def end_with_parent(by: int) -> None:
    """Have the system send this signal to this process when its parent ends, where the system can do that; 0 for none.

    The closed channel tells the same, unless a process that the parent has forked holds its other end.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, by, 0, 0, 0)
