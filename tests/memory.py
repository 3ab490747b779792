"""`python -m tests.memory COMMAND ...`: run a command, and print the most memory that it and all processes that it started had at a time.

What several processes share counts once (PSS), as far as the kernel tells. Exit code: that of the command, or 1 if it took more than 4 GB. For
instance ``python -m tests.memory python -m robot run --processes --duration 40``, or ``python -m tests.memory pytest -q``.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from robot.evaluate.load import family

__all__ = ["LIMIT", "main", "taken"]

LIMIT = 4 * 10**9
"""Bytes."""
EVERY = 0.2
"""Seconds between two looks."""


def main(command: Sequence[str]) -> int:
    """Run the command to its end."""
    most = processes = 0
    with subprocess.Popen(command) as process:
        while process.poll() is None:
            there = family(process.pid)
            now = taken(there)
            if now > most:
                most, processes = now, len(there)
            try:
                process.wait(EVERY)
            except subprocess.TimeoutExpired:
                continue
    print(f"at most {most / 1e9:.2f} GB in {processes} processes at a time", flush=True)
    return process.returncode or int(most > LIMIT)


def taken(processes: Iterable[int]) -> int:
    """The memory of these processes, bytes; those that have ended have none."""
    return sum(map(_taken_by, processes))


def _taken_by(process: int) -> int:
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:"))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
