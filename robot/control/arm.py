"""The robot's arm as its node drives it: one motion at a time, always within limits, stopped smoothly when cancelled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robot.hardware.arm import ArmBusy, ArmState
from robot.model.arm import STOWED, check_angles
from robot.planning.trajectory import Motion, Point, Quintic, Stop


class Arm:
    """Four joints that follow their targets exactly. Times are seconds of any one clock that never goes back."""

    __slots__ = ("_began", "_motion", "_progress")

    def __init__(self, position: Sequence[float] = STOWED) -> None:
        here = np.array(check_angles(position))
        self._motion: Motion = Quintic(here, here, 0.0)
        self._began = 0.0
        self._progress = 1.0

    def move(self, target: Sequence[float], now: float) -> float:
        """Begin to move to four joint angles; returns how long it takes, s.

        Raises `ArmBusy` while a motion lasts (cancel it first), `ValueError` for angles the arm cannot take.
        """
        goal = np.array(check_angles(target))
        if self._moving(now):
            raise ArmBusy(
                f"The arm is still moving, for {self._left(now):.2f} s: cancel that motion or wait for its end."
            )
        motion = Quintic.between(self._motion.at(self._motion.duration).position, goal)
        self._motion, self._began, self._progress = motion, now, 0.0
        return motion.duration

    def cancel(self, now: float) -> float:
        """Brake within limits; returns how long that takes, s. Without a motion, or while braking already, nothing changes."""
        if self._moving(now) and isinstance(self._motion, Quintic):
            self._progress = self._motion.progress(now - self._began)
            self._motion, self._began = Stop(self._motion.at(now - self._began)), now
        return self._left(now)

    def at(self, now: float) -> ArmState:
        """The arm's state at `now`."""
        point: Point = self._motion.at(now - self._began)
        progress = self._motion.progress(now - self._began) if isinstance(self._motion, Quintic) else self._progress
        return ArmState(point.position, point.velocity, self._moving(now), progress)

    def _moving(self, now: float) -> bool:
        return self._left(now) > 0.0

    def _left(self, now: float) -> float:
        return max(0.0, self._began + self._motion.duration - now)
