"""A model of one processor that many processes share without priorities: when control gets which samples, and when its targets are out.

Fair scheduling as Linux does it: of the processes that are ready the one that has had least runs on, for a whole turn; one that wakes waits for
the end of the turn that is going on, and has no claim to what it did not use while it slept. No process is simulated, only its need of time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final

import numpy as np

from robot.hardware.overdue import taken_together

PERIOD: Final = 0.005
"""Of samples, s."""
TURN: Final = 0.004
"""How long a process runs while others wait, s: a tick of Linux at 250 Hz."""
KEPT: Final = 40
"""Samples that wait for control; of more, the newest stay."""
BODY: Final = 0.0008
"""Processor time of the body for one sample, s."""
MORE: Final = 0.05
"""What each further sample that is taken together with others costs of the time for one."""
LIGHT: Final = 335.0 / 1024.0
"""Weight of a process that stepped back by nice 5."""
OTHERS: Final = {"main": (1.0, 0.08, 0.02), "safety": (LIGHT, 0.07, 0.02), "perception": (LIGHT, 0.1, 0.1), "navigation": (LIGHT, 0.1, 0.1),
                 "mission": (LIGHT, 0.05, 0.02)}  # fmt: skip
"""The other processes of the robot: weight, share of a processor, and seconds between two of their jobs."""
_ENOUGH: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Load:
    """What shares the processor."""

    loops: int
    """Endless loops, of the same priority as body and control."""
    control: float
    """Processor time of control for one sample, s."""
    together: bool = True
    """Whether control takes samples together that have waited too long, as it does; otherwise each by itself."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One step of control."""

    samples: tuple[int, ...]
    """Their numbers; sample n is of the instant n `PERIOD`."""
    at: float
    """When the targets are out, s."""


class _Process:
    """What wants to run. Its jobs are numbers: of seconds, or of samples."""

    def __init__(self, weight: float = 1.0) -> None:
        self.weight = weight
        self.had = 0.0
        """Its running time by its weight, s."""
        self.jobs = deque[float]()
        self.left = 0.0
        """Of the job that it is at, s."""

    @property
    def ready(self) -> bool:
        return self.left > 0.0 or bool(self.jobs)

    def begin(self, now: float) -> float:
        """Take the next job: what it needs, s."""
        return self.jobs.popleft()

    def finish(self, now: float) -> None:
        """The job is done."""


class _Body(_Process):
    """Takes samples when they are due, and hands them on."""

    def __init__(self, hand_on: Callable[[float], None]) -> None:
        super().__init__()
        self._hand_on, self._taken = hand_on, 0.0

    def begin(self, now: float) -> float:
        self._taken = self.jobs.popleft()
        return BODY

    def finish(self, now: float) -> None:
        self._hand_on(self._taken)


class _Control(_Process):
    """Makes targets of samples."""

    def __init__(self, load: Load) -> None:
        super().__init__()
        self.jobs = deque[float](maxlen=KEPT)
        self.steps: list[Turn] = []
        self._load, self._taken = load, list[float]()

    def begin(self, now: float) -> float:
        many = taken_together(1.0 / PERIOD, now - self.jobs[0] * PERIOD) if self._load.together else 1
        self._taken = [self.jobs.popleft() for _ in range(min(many, len(self.jobs)))]
        return self._load.control * (1.0 + MORE * (len(self._taken) - 1))

    def finish(self, now: float) -> None:
        self.steps.append(Turn(tuple(map(int, self._taken)), now))


class _Core:
    """Gives turns to processes. `coming` are their jobs: when, whose, and what."""

    def __init__(self, load: Load, seed: int, seconds: float) -> None:
        self.control = _Control(load)
        body = _Body(lambda sample: self._give(self.control, sample))
        loops = [_Process() for _ in range(load.loops)]
        self._processes: list[_Process] = [*loops, body, self.control]
        coming: list[tuple[float, _Process, float]] = [(0.0, loop, inf) for loop in loops]
        coming += [(number * PERIOD, body, float(number)) for number in range(1, int(seconds / PERIOD))]
        random = np.random.default_rng([seed, 44])
        for weight, share, period in OTHERS.values():
            other = _Process(weight)
            self._processes.append(other)
            starts = np.arange(random.uniform(0.0, period), seconds, period)
            coming += [(float(at), other, float(share * period * random.exponential())) for at in starts]
        self._coming = deque(sorted(coming, key=lambda one: one[0]))

    def run(self) -> None:
        """Until no job comes any more."""
        now = 0.0
        while self._coming:
            self._arrive(now)
            ready = [one for one in self._processes if one.ready]
            now = self._turn(min(ready, key=lambda one: one.had), now) if ready else self._coming[0][0]

    def _turn(self, process: _Process, now: float) -> float:
        """One turn of a process; when it ends, s."""
        began, end = now, now + TURN
        while process.ready and now < end - _ENOUGH:
            process.left = process.left or process.begin(now)
            used = min(process.left, end - now)
            now, process.left = now + used, process.left - used
            if process.left < _ENOUGH:
                process.left = 0.0
                process.finish(now)
            self._arrive(now)
        process.had += (now - began) / process.weight
        return now

    def _arrive(self, now: float) -> None:
        while self._coming and self._coming[0][0] <= now:
            _, process, job = self._coming.popleft()
            self._give(process, job)

    def _give(self, process: _Process, job: float) -> None:
        """A job for a process. One that slept starts level with the one that has had least."""
        if not process.ready:
            process.had = max(process.had, min((one.had for one in self._processes if one.ready), default=0.0))
        process.jobs.append(job)


def turns(load: Load, seed: int, seconds: float) -> list[Turn]:
    """The steps of control, in their order, within so many seconds. The same seed gives the same ones."""
    core = _Core(load, seed, seconds)
    core.run()
    return core.control.steps
