"""A busy machine, on request, and what a program and all of its processes take of the processors."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_PROC: Final = Path("/proc")
ENDLESS: Final = "while True: pass"


@contextmanager
def busy(loops: int) -> Generator[frozenset[int]]:
    """Run so many endless loops, of this process's own priority, on one processor, and hold this process and those that it starts to the same.

    Yields the loops' processes. Without any loops nothing changes. Raises `OSError` where processes cannot be held to processors.
    """
    if loops == 0:
        yield frozenset()
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    others = [subprocess.Popen([sys.executable, "-c", ENDLESS]) for _ in range(loops)]
    try:
        yield frozenset(other.pid for other in others)
    finally:
        for other in others:
            other.kill()
            other.wait()
        os.sched_setaffinity(0, before)


def family(root: int) -> set[int]:
    """The process `root`, those that it has started, and those that these have, as /proc tells."""
    parents: dict[int, int] = {}
    for path in _PROC.glob("[0-9]*"):
        try:
            parents[int(path.name)] = int(_fields(path)[1])
        except OSError:
            continue  # it has just ended
    found, waiting = set[int](), [root]
    while waiting:
        one = waiting.pop()
        found.add(one)
        waiting += [child for child, parent in parents.items() if parent == one and child not in found]
    return found


def processor_seconds(processes: set[int]) -> float:
    """Processor time, of users and of the system, that these processes have taken so far, s; those that have ended do not count."""
    ticks = 0
    for one in processes:
        try:
            user, system = _fields(_PROC / str(one))[11:13]
        except OSError:
            continue
        ticks += int(user) + int(system)
    return ticks / os.sysconf("SC_CLK_TCK")


def _fields(path: Path) -> list[str]:
    """Of /proc/PID/stat, from the state on: the name before it may have blanks."""
    return (path / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
