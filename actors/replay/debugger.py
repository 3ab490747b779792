"""`Break`: where a replay stops in a debugger."""

from __future__ import annotations

import inspect
import os
import pdb
import sys
from collections.abc import Callable

from actors.replay.errors import ReplayError


class Break:
    """Stops in a debugger at one message: the `number`-th, from 0, of `topic`.

    `debugger` starts another debugger than that of `breakpoint()`.
    """

    def __init__(self, topic: str, number: int, debugger: Callable[[], object] | None = None) -> None:
        self.topic = topic
        self.number = number
        self._debugger = debugger
        self._own: pdb.Pdb | None = None

    def at(self, topic: str, number: int) -> bool:
        """Whether this is the message."""
        return (topic, number) == (self.topic, self.number)

    def stop(self) -> None:
        """Start the debugger, in the frame of the caller."""
        if self._debugger is not None:
            self._debugger()
        elif sys.breakpointhook is not sys.__breakpointhook__ or "PYTHONBREAKPOINT" in os.environ:
            breakpoint()
        else:
            self._own = pdb.Pdb()
            self._own.set_trace(inspect.stack(0)[1].frame)

    def check_over(self) -> None:
        """Raise `ReplayError` if the debugger was quit: it then has thrown an error into the node, which would be taken for the node's."""
        if self._own is not None and self._own.quitting:
            raise ReplayError("the debugger was quit, and the replay with it: there is no verdict")
