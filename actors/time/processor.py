"""What a thread gets of the processors: how long it has run, and for how long it has waited to run. Linux tells it."""

from __future__ import annotations

import os
from typing import NamedTuple


class Share(NamedTuple):
    """Of one thread since it began, in seconds."""

    ran: float
    waited: float
    """While it could have run, and other threads or a limit of its control group kept it from that; a wait that goes on is not counted yet."""


class Processor:
    """Reads the `Share` of a thread: ``self/task/ID`` is one of this process, and a process id the main thread of another.

    Zeros where the system does not tell, and when the thread has ended.
    """

    def __init__(self, thread: str) -> None:
        try:
            self._file = os.open(f"/proc/{thread}/schedstat", os.O_RDONLY | os.O_CLOEXEC)
        except OSError:
            self._file = -1

    def share(self) -> Share:
        """Costs some microseconds. May be called from any thread."""
        try:
            ran, waited, _ = os.pread(self._file, 96, 0).split()
        except (OSError, ValueError):
            return Share(0.0, 0.0)
        return Share(int(ran) / 1e9, int(waited) / 1e9)

    def close(self) -> None:
        """Read no more."""
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


def is_runnable(process: int) -> bool:
    """Whether the main thread of a process runs, or could if it had a processor. False where the system does not tell, and after its end."""
    try:
        with open(f"/proc/{process}/stat", "rb") as file:
            return file.read().rpartition(b")")[2].split(maxsplit=1)[0] == b"R"
    except (OSError, IndexError):
        return False
