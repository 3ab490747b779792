"""What a robot without a map sees by its LiDAR: level scans, whether the LiDAR hangs level in a gimbal or turns on a body that leans."""

from __future__ import annotations

from math import inf
from typing import Protocol

from actors.tf2 import Transform
from robot.control.gait_state import GaitState
from robot.estimation.deskew import Deskew
from robot.estimation.history import pose_history
from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.sim.simulation import Simulation

SCAN = 20
"""Gait steps between two scans (10 Hz)."""


class Sight(Protocol):
    """What a robot without a map sees by its LiDAR."""

    def moved(self, now: float, state: GaitState) -> None:
        """Where the body is at `now` (s), as far as it knows."""
        ...

    def look(self, tick: int) -> tuple[Floats | None, Pose2 | None]:
        """Ranges (m) of a new level scan, and where it was taken unless that is here; None without one."""
        ...


class Level:
    """A LiDAR in a gimbal, all of whose beams look at one instant."""

    def __init__(self, body: Simulation) -> None:
        self._body = body

    def moved(self, now: float, state: GaitState) -> None:
        """It needs nothing of that."""

    def look(self, tick: int) -> tuple[Floats | None, Pose2 | None]:
        """One scan every 0.1 s."""
        return (self._body.lidar(), None) if tick % SCAN == 0 else (None, None)


class Leveled:
    """A LiDAR that turns on a body that walks and leans: its sweeps are corrected by odometry."""

    def __init__(self, body: Simulation) -> None:
        self._body = body
        self._deskew, self._poses = Deskew(), pose_history()
        self._seen = -inf

    def moved(self, now: float, state: GaitState) -> None:
        """Keep it for the sweeps to come."""
        x, y, z = state.position.tolist()
        w, qx, qy, qz = state.quaternion.tolist()
        self._deskew.add(now, (x, y, z), Transform(rotation=(w, qx, qy, qz)).rpy)
        self._poses.add(now, Pose2(x, y, yaw_of(w, qx, qy, qz)))

    def look(self, tick: int) -> tuple[Floats | None, Pose2 | None]:
        """The newest sweep, once."""
        sweep, newest = self._body.sweep(), self._deskew.newest
        if sweep is None or sweep.start == self._seen or newest is None:
            return None, None
        self._seen = sweep.start
        at = min(sweep.start + sweep.sweep, newest)
        return self._deskew.corrected(sweep.ranges, sweep.start, sweep.sweep, at), self._poses.at(at)
