"""A body in physics that writes down, at every physics step, what of the world touches any part of it but its feet."""

from __future__ import annotations

from collections import deque
from math import hypot, inf
from typing import Any

from robot.hardware.body import LEGS
from robot.sim.physics import PhysicsBody

_WINDOW = 0.5
"""Over which speed is averaged, s: a gait period."""


class WatchedBody(PhysicsBody):
    """For judges. Nothing is written down until `watch` is called."""

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        self._after = inf
        self.bumps: dict[str, float] = {}
        """Geometry of the world, its name in the model -> when it was first touched, s."""
        self.fastest = 0.0
        """Highest speed over half a second, m/s."""
        self._feet = {self._model.geom(f"{leg}_foot").id for leg in LEGS}
        self._world = {i for i in range(self._model.ngeom) if self._model.body_weldid[self._model.geom_bodyid[i]] == 0}
        self._places: deque[tuple[float, float, float]] = deque()

    def watch(self, after: float) -> None:
        """Write down from that time on, s; `inf` ends it."""
        self._after = after

    def _step(self, ticks: int) -> None:
        super()._step(ticks)
        if self.time < self._after:
            return
        for pair in self._data.contact.geom.tolist():
            touched = [geom for geom in pair if geom in self._world]
            if touched and not self._feet.intersection(pair):
                self.bumps.setdefault(self._model.geom(touched[0]).name, round(self.time, 2))
        x, y = self._qpos[:2].tolist()
        self._places.append((self.time, x, y))
        while self._places[0][0] < self.time - _WINDOW:
            self._places.popleft()
        begun, x0, y0 = self._places[0]
        if self.time - begun > 0.9 * _WINDOW:
            self.fastest = max(self.fastest, hypot(x - x0, y - y0) / (self.time - begun))
