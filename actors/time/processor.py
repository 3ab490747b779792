"""What a thread gets of the processors: how long it has run, and for how long it has waited to run."""

from __future__ import annotations

import os
from typing import NamedTuple

__all__ = ["Processor", "Share"]


class Share(NamedTuple):
    """Of one thread since it began, in seconds."""

    ran: float
    waited: float
    """While it could have run and other threads, or a limit of its control group, had the processors."""


class Processor:
    """Reads the `Share` of a thread of this process, as Linux counts it; zeros on other systems, and when the thread has ended."""

    def __init__(self, native_id: int) -> None:
        try:
            self._file = os.open(f"/proc/self/task/{native_id}/schedstat", os.O_RDONLY | os.O_CLOEXEC)
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
