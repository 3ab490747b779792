"""Feedback of a long task: stages in order, a distance that never grows, and per cent that never fall."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

CANCELED = "Task canceled"
"""What the result of a task says that was interrupted, by its client or by the end of its node."""


class Told(NamedTuple):
    """One feedback."""

    stage: str
    distance: float
    percent: float


class TaskFeedback:
    """The progress of one task. `stages` are the names, each with the per cent at which it begins; a stage that is repeated is not reported twice."""

    __slots__ = ("_distance", "_percent", "_reached", "_stages")

    def __init__(self, stages: Sequence[tuple[str, float]], distance: float) -> None:
        self._stages = tuple(stages)
        self._reached = 0
        self._distance = distance
        self._percent = 0.0

    def tell(self, stage: str, share: float = 0.0, distance: float = inf) -> Told:
        """The next feedback: `share` (0..1) of the stage is done, and `distance` m are left to walk."""
        index = [name for name, _ in self._stages].index(stage)
        if index >= self._reached:
            self._reached = index
            begins, ends = self._stages[index][1], [*(at for _, at in self._stages[1:]), 100.0][index]
            self._percent = max(self._percent, begins + (ends - begins) * min(1.0, max(0.0, share)))
        self._distance = min(self._distance, max(0.0, distance))
        return Told(self._stages[self._reached][0], self._distance, self._percent)
