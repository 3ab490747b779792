"""Sensor samples taken by the body's own time, as a sensor board with a FIFO does.

A process that the operating system holds up for 15 ms reads late, but it misses no sample: those that were due wait for it, each of
its own instant. So the rates of the sensors, and what an estimator sees, do not depend on how promptly the loop is scheduled.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from robot.hardware.body import Sample

KEPT = 40
"""Samples that wait for their reader; of more, the newest stay."""
ROUNDING = 1e-9


class Sampling:
    """Splits a body's advance at the instants at which samples are due, and keeps those until they are read.

    `integrate` takes the body up to a simulated instant; `take` reads the sensors at the one that it has reached.
    """

    def __init__(self, integrate: Callable[[float], None], take: Callable[[], Sample]) -> None:
        self._integrate = integrate
        self._take = take
        self._waiting: deque[Sample] = deque(maxlen=KEPT)
        self._start = 0.0
        self._hz = 0.0
        self._count = 0

    def begin(self, now: float, hz: float) -> None:
        """Sample at `now + k / hz`; samples taken before are forgotten."""
        self._waiting.clear()
        self._start, self._hz, self._count = now, hz, 0

    def advance(self, until: float) -> None:
        """Integrate up to `until`, with a stop at every instant at which a sample is due."""
        while self._hz > 0.0:
            due = self._start + (self._count + 1) / self._hz
            if due > until + ROUNDING:
                break
            self._integrate(due)
            self._count += 1
            self._waiting.append(self._take())
        self._integrate(until)

    def next(self) -> Sample | None:
        """The oldest sample that nobody has read."""
        return self._waiting.popleft() if self._waiting else None
