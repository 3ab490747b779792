"""Processor time for the guard: what the operating system allows, and one line on what it does not."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Final, Literal

from robot.link.time_slices import short_turns

PRIORITY: Final = {"body": 20, "control": 10}
"""Of real-time scheduling. The body is hardware: it goes before its controllers."""
SWITCH: Final = "ROBACTOR_REALTIME"
NICE: Final = 10
"""How much processes that can wait step back: beside two endless loops control has then as large a share of one processor as it needs."""


def favour(role: Literal["body", "control"]) -> str:
    """Ask for real-time scheduling of this process: it runs as soon as it is ready. What came of it, in one line.

    It is not asked for where the variable ROBACTOR_REALTIME is 0. Without it the process asks for short turns, which need no privilege.
    """
    if os.environ.get(SWITCH) == "0":
        return f"{role}: no real-time scheduling, as {SWITCH} is 0; {_turns()}"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY[role]))
    except (AttributeError, OSError) as error:
        return f"{role}: no real-time scheduling here ({type(error).__name__}); {_turns()}"
    return f"{role}: real-time scheduling, SCHED_FIFO {PRIORITY[role]}"


def _turns() -> str:
    if short_turns():
        return "short turns: a machine that is busy holds it up little"
    return "a busy machine can hold it up"


def step_aside() -> str:
    """Leave one processor to the guard, and the others to it first: for processes that can wait. What came of it, in one line."""
    words: list[str] = []
    with suppress(OSError):
        words.append(f"nice {os.nice(NICE)}")
    try:
        allowed = sorted(os.sched_getaffinity(0))
        if len(allowed) > 1:
            os.sched_setaffinity(0, allowed[:-1])
            words.append(f"off processor {allowed[-1]}")
        else:
            words.append("one processor: shared with the guard")
    except (AttributeError, OSError) as error:
        words.append(f"no choice of processors here ({type(error).__name__})")
    return ", ".join(words)
