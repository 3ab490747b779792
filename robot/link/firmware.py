"""The firmware of the motor drives: what they do by themselves when nobody commands them any more."""

from __future__ import annotations

from typing import Final

from robot.control.safe_stop import SafeStop
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.link.fence import Fence
from robot.model.actuators import SILENCE
from robot.model.robot import SPOT, RobotModel

PERIOD: Final = 0.005
"""Seconds between the targets that they then give themselves."""


class Drives:
    """Watches over the targets of one body, and sits it down, damped, when they stop.

    Invariants:

    - Before the first targets, and as long as they keep coming, there are none of its own: a robot that lies stays limp.
    - A command counts only from the newest of the processes that have commanded: one that was taken for dead and comes back is refused.
    - Instants never go back.
    """

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._model = model
        self._heard: float | None = None
        self._stop: SafeStop | None = None
        self._stepped = 0.0
        self._fence = Fence()

    @property
    def heard(self) -> float | None:
        """When the last targets were given; `None` before the first, and while they act by themselves."""
        return self._heard if self._stop is None else None

    @property
    def refused(self) -> int:
        """How many commands came of processes that have been replaced."""
        return self._fence.refused

    @property
    def stopping(self) -> bool:
        """Whether they act by themselves."""
        return self._stop is not None

    @property
    def resting(self) -> bool:
        """Whether the robot sits because of that, or was never commanded."""
        return self._heard is None or (self._stop is not None and self._stop.done)

    def admits(self, epoch: int) -> bool:
        """Whether a command of process `epoch` counts, of whatever kind it is."""
        return self._fence.admits(epoch)

    def obey(self, at: float, epoch: int) -> bool:
        """Whether to follow the targets that process `epoch` gave at `at`."""
        if not self.admits(epoch):
            return False
        self._heard, self._stop = at, None
        return True

    def due(self) -> float | None:
        """When they next want to act by themselves; `None` before the first targets."""
        if self._heard is None:
            return None
        return self._heard + SILENCE if self._stop is None else self._stepped + PERIOD

    def act(self, at: float, joints: JointSample, imu: ImuSample) -> MotorTargets:
        """The targets that they give themselves at `at`, when that is due."""
        first = self._stop is None
        if self._stop is None:
            self._stop = SafeStop(self._model)
        dt = PERIOD if first else at - self._stepped
        self._stepped = at
        return self._stop.step(dt, joints, imu)
