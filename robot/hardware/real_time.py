"""How fast the simulated robot is beside real time, and what to tell people about it."""

from __future__ import annotations

import asyncio
import time
from typing import Any, Final

from actors.time.lockstep import lockstep_of

WINDOW: Final = 3.0
"""Real seconds over which it is measured. The first of them belong to the start, which is not warned of."""
SLOW: Final = 0.8
"""A factor below this is reported."""
REMEDY: Final = (
    "--clock virtual needs no real time; --backend kinematic, fewer sensors or other programs ended make it faster"
)


class RealTime:
    """Compares the running loop's clock with real time (`actors.time.lockstep`). Where no world is simulated on it, the factor stays 1."""

    def __init__(self) -> None:
        self._lockstep = lockstep_of(asyncio.get_running_loop())
        self.factor = 1.0
        """Simulated seconds in a real one, in the last whole window; time for which the process was stopped does not count."""
        self._windows = 0
        self._told = False
        self._begin(time.monotonic())

    def look(self) -> tuple[str, dict[str, Any]] | None:
        """To be called several times a second. A warning that is due, if there is one: the text and the fields of a log line."""
        step = self._lockstep
        if step is None:
            return None
        now = time.monotonic()
        stopped = step.stopped - self._stopped
        if stopped > 0.0:
            self._begin(now)
            return f"the robot stood still for {stopped:.1f} s: its process was stopped, or the machine slept", {}
        real = now - self._began
        if real < WINDOW:
            return None
        self.factor = min(1.0, max(0.0, 1.0 - (step.slipped - self._slipped) / real))
        share = (time.process_time() - self._processor) / real
        self._begin(now)
        self._windows += 1
        if self.factor >= SLOW or self._windows == 1 or self._told:
            return None
        self._told = True
        text = f"this machine runs the robot at {self.factor:.2f} of real time"
        return text, {"got": f"{share:.0%} of a core", "remedy": REMEDY}

    def _begin(self, now: float) -> None:
        """Begin a window."""
        self._began, self._processor = now, time.process_time()
        self._slipped = self._lockstep.slipped if self._lockstep is not None else 0.0
        self._stopped = self._lockstep.stopped if self._lockstep is not None else 0.0
