"""`Watchdog`: the thread of a process that notes what its event loop hangs in, and ends the process when its parent is gone."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Final

ORPHAN_SECONDS: Final = 5.0
"""How long a process may go on after its parent is gone: its nodes have this time to end in order."""
NOTED_SECONDS: Final = 0.2
"""An event loop that has not turned for so long is looked at, before the parent speaks of it."""
_LOOK: Final = 0.1
"""Seconds between two looks."""


class Watchdog:
    """Watches the channel to the parent (`channel`, a descriptor), the process descriptor of the parent, if `parent` is one, and the event loop
    that calls `turned`.

    What the loop hangs in, as `where` says, is written to the pipe `notes`, once each time: the channel belongs to the loop. `where` looks at
    what the loop changes meanwhile; when it fails, its error is noted.

    Invariants: the thread is a daemon, so it does not hold up the end of the process. `_turned` is None before the loop has first turned.
    """

    def __init__(
        self,
        channel: int,
        notes: int,
        where: Callable[[], str],
        orphaned: Callable[[], None] = lambda: os._exit(1),
        orphan_seconds: float = ORPHAN_SECONDS,
        parent: int | None = None,
    ) -> None:
        self._channel = channel
        self._parent = parent
        self._notes = notes
        self._where = where
        self._orphaned = orphaned
        self._orphan_seconds = orphan_seconds
        self._turned: float | None = None
        self._noted = False
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robactor watchdog", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Let the thread end, within a tenth of a second: the process ends by itself."""
        self._over.set()

    def turned(self) -> None:
        """The event loop turns; called from it."""
        self._turned = monotonic()
        self._noted = False

    def _run(self) -> None:
        poll = select.poll()
        poll.register(self._channel, 0)  # a channel whose other end is closed is reported without being asked for
        if self._parent is not None:
            poll.register(self._parent, select.POLLIN)
        while not self._over.is_set():
            if poll.poll(_LOOK * 1000):
                if not self._over.wait(self._orphan_seconds):
                    self._orphaned()
                return
            self._look(monotonic())

    def _look(self, now: float) -> None:
        if self._turned is not None and now - self._turned >= NOTED_SECONDS and not self._noted:
            self._noted = True
            try:
                where = self._where()
            except Exception as error:  # the watchdog goes on: it has to end this process with its parent
                where = f"not known: {error!r}"
            with suppress(OSError):  # the parent has not looked for very long, or is gone
                os.write(self._notes, f"{where}\n".encode()[-select.PIPE_BUF :])
