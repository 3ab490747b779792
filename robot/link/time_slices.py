"""Short turns on a processor, which Linux gives to any thread that asks: no privilege, no larger share, but a turn that comes sooner.

A process that wakes beside endless loops gets its turn when its virtual deadline is the earliest, and that is its share's length after it became
due: with turns of 0.1 ms instead of 1.4 it goes before them at once, as long as it takes no more than its share. See sched(7), sched_setattr(2),
and "EEVDF Scheduler" in the kernel's documentation; since Linux 6.12 a normal process chooses the length of its turns.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
from typing import Final

TURN: Final = 100_000
"""Nanoseconds: the shortest that the kernel allows."""
_CALLS: Final = {"x86_64": (314, 315), "aarch64": (274, 275), "riscv64": (274, 275)}
"""The numbers of sched_setattr and sched_getattr, which the C library does not offer everywhere."""
_FORM: Final = struct.Struct("=IIQiIQQQ")
"""struct sched_attr: size, policy, flags, nice, real-time priority, runtime, deadline, period."""


def short_turns() -> bool:
    """Ask for turns of `TURN` for this thread, and those that it starts from now on. Whether the kernel gives them.

    A thread that is not scheduled as a normal one (``SCHED_OTHER``) is left as it is.
    """
    calls = _CALLS.get(platform.machine()) if platform.system() == "Linux" else None
    if calls is None or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    set_attributes, get_attributes = calls
    system = ctypes.CDLL(None)
    asked = _FORM.pack(_FORM.size, os.SCHED_OTHER, 0, os.getpriority(os.PRIO_PROCESS, 0), 0, TURN, 0, 0)
    system.syscall(set_attributes, 0, asked, 0)
    given = ctypes.create_string_buffer(_FORM.size)
    if system.syscall(get_attributes, 0, given, _FORM.size, 0) != 0:
        return False
    runtime: int = _FORM.unpack(given.raw)[5]
    return runtime == TURN  # an older kernel takes the call, and says 0
