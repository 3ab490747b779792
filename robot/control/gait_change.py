"""Which gait a walk has, and when it may change to another."""

from __future__ import annotations

from math import hypot

from robot.control.command import CommandLimits
from robot.control.gaits import Gait, gait_named, gaits_of
from robot.control.walk import WalkController
from robot.estimation.predict import PredictedState
from robot.model.robot import SPOT, RobotModel

HASTE = 0.2
"""A body that is faster than its command by more than this (m/s) has been pushed: no moment to change the gait."""
MOST_WAIT = 0.5
"""Seconds for which feet are kept from lifting to change the gait, and after which they may lift for as long before the next attempt."""
CATCH_TIME = 1.5
"""Seconds of trot after a gait that sways has lost its balance."""


class GaitChange:
    """The gait that was asked for, and the way of a walk to it."""

    def __init__(self, name: str, model: RobotModel = SPOT) -> None:
        """Raises ValueError for an unknown name, as `select` does."""
        self._model = model
        self.wanted = gait_named(name, model)
        self._catching = self._held_for = 0.0

    def begin(self) -> None:
        """A walk begins, with the gait that was asked for: what held up an earlier one is over."""
        self._catching = self._held_for = 0.0

    def select(self, name: str) -> None:
        """Ask for another gait. Raises ValueError for an unknown name."""
        self.wanted = gait_named(name, self._model)

    def step(
        self, dt: float, walker: WalkController, ahead: PredictedState, command: tuple[float, float, float]
    ) -> None:
        """Let no foot lift until all stand, then go on with the gait asked for, once the walk is slow enough for it. `command`: the velocity in force.

        A foot that finds no ground does not hold up the others for ever.
        """
        gait = self._chosen(dt, walker)
        if walker.clock.gait is gait or not _slow_enough(gait, ahead, walker, command):
            self._held_for = 0.0
            return
        self._held_for += dt
        walker.halting = self._held_for % (2.0 * MOST_WAIT) < MOST_WAIT
        if walker.halting and walker.grounded:
            walker.halting, self._held_for = False, 0.0
            walker.change(gait, ahead)

    def bounds(self, walker: WalkController) -> tuple[CommandLimits | None, ...]:
        """The velocities that the gait in use, and one that waits to be used, allow."""
        waiting = self.wanted if self.wanted is not walker.clock.gait else None
        return (walker.bound, (waiting.entry or waiting.most) if waiting is not None else None)

    def _chosen(self, dt: float, walker: WalkController) -> Gait:
        """The gait asked for; a trot for a while if that one has lost its balance: a trot can catch itself."""
        self._catching = CATCH_TIME if walker.upset else max(0.0, self._catching - dt)
        return gaits_of(self._model)["trot"] if self._catching > 0.0 and self.wanted.sway is not None else self.wanted


def _slow_enough(
    gait: Gait, ahead: PredictedState, walker: WalkController, command: tuple[float, float, float]
) -> bool:
    """Whether a walk may change to `gait` now."""
    limits = gait.entry or gait.most
    if limits is None:
        return True
    return limits.allows(command) and walker.speed(ahead) < hypot(command[0], command[1]) + HASTE
