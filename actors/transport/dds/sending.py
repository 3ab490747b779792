"""The thread that writes what cannot be written at once."""

from __future__ import annotations

import threading
import time
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Final

from actors.transport.dds.library import Vector

if TYPE_CHECKING:
    from actors.transport.dds.endpoints import Writer

_ROUND: Final = 0.002
"""Seconds after which full writers are tried again, if none of their readers is faster."""

LINGERS: Final = 1.0
"""Seconds for which a writer that is closed still writes what waits."""


class Sending:
    """One thread for all writers of a participant. A writer that is full lets the others pass.

    Invariants: the thread runs between construction and `end`; it alone writes the samples that wait, and ends the writers.
    """

    def __init__(self) -> None:
        self._asked: SimpleQueue[tuple[Writer, bool] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="dds sending", daemon=True)
        self._thread.start()

    def write(self, writer: Writer) -> None:
        """Write what waits in `writer`."""
        self._asked.put((writer, False))

    def close(self, writer: Writer) -> None:
        """Write what waits in `writer`, for a second at most, and end it."""
        self._asked.put((writer, True))

    def end(self) -> None:
        """End the thread, after the writers that have been closed, and wait for its end."""
        self._asked.put(None)
        self._thread.join()

    def _run(self) -> None:
        vector = Vector()
        full: dict[Writer, None] = {}
        closing: dict[Writer, float] = {}
        ending = False
        while not (ending and not closing):
            try:
                asked = self._asked.get_nowait() if full else self._asked.get()
            except Empty:
                next(iter(full)).wait(_ROUND)
                turn = list(full)
            else:
                if asked is None:
                    ending = True
                    continue
                writer, closed = asked
                if closed:
                    closing[writer] = time.monotonic() + LINGERS
                turn = [writer]
            for writer in turn:
                full.pop(writer, None)
                empty = writer.write_next(vector)
                if writer in closing and (empty or time.monotonic() > closing[writer]):
                    del closing[writer]
                    writer.end()
                elif not empty:
                    full[writer] = None
