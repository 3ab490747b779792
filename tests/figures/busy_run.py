"""One robot that walks in physics while its control is as late as the model of a shared processor says, in virtual time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from robot.hardware.body import Sample
from robot.hardware.overdue import SPAN, merged
from robot.link.firmware import Drives
from robot.model.modes import ON_ITS_FEET, Mode
from robot.navigation.limits import Limits
from robot.nodes.gait import FRESH
from robot.testing import Trial
from tests.figures.fidelity import Fidelity
from tests.figures.turns import PERIOD, Load, Turn, turns

CHANGE: Final = 1.5
"""Seconds between two commands."""
SLOWEST: Final = 0.2
"""Of a robot that is not told to stand or to turn on the spot, m/s."""
STEPPING: Final = 0.2
"""Share of the commands without speed."""
STRAIGHT: Final = 0.3
"""Share of those without a turn."""
LOST: Final = 0.1
"""Seconds without a sample after which the legs count as unknown: `sensor_timeout` of the gait."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How it went."""

    fallen: float | None
    """When it fell, s."""
    age_median: float
    age_p99: float
    """How old a step's newest sample was when its targets were out, s."""
    taken_over: int
    """How often the drives had to act by themselves."""


class _Robot:
    """A robot that walks, its control, and the drives' firmware."""

    def __init__(self, seed: int, fidelity: Fidelity, delay: float) -> None:
        self._trial = Trial(seed, conditions=fidelity.conditions(delay))
        self._trial.stand_up()
        self._trial.gait.request(Mode.WALK)
        self._body, self._drives = self._trial.body, Drives()
        self._began = self._body.time
        self._drives.obey(self._began, 1)
        self._body.sample(1.0 / PERIOD)
        self._last = self._began
        self.taken_over = 0

    @property
    def fallen(self) -> bool:
        truth = self._body.truth()
        return truth.fallen or (truth.lying and self._trial.gait.mode in ON_ITS_FEET)

    def command(self, forward: float, turn: float) -> None:
        self._trial.gait.command(forward, 0.0, turn)

    def step(self, turn: Turn) -> None:
        """What control does in its turn."""
        at = self._began + turn.at
        self._advance(at)
        sample = merged([self._sample(number) for number in turn.samples])
        gait, gap = self._trial.gait, sample.time - self._last
        self._last = sample.time
        if gap > LOST:
            gait.interrupt()
        if self._drives.stopping:
            gait.overtake()
        if gait.overtaken and at - sample.time > FRESH:
            gait.follow(min(gap, SPAN), sample.imu, sample.joints)
            return
        targets = gait.step(min(gap, SPAN), sample.imu, sample.joints)
        self._drives.obey(at, 1)
        self._body.command(targets)

    def _sample(self, number: int) -> Sample:
        """The one of this number; those before that have not been taken are lost."""
        due = self._began + (number - 0.5) * PERIOD
        return next(sample for sample in iter(self._body.next_sample, None) if sample.time > due)

    def _advance(self, until: float) -> None:
        while (due := self._drives.due()) is not None and due <= until:
            self._body.advance(due)
            self.taken_over += not self._drives.stopping
            self._body.command(self._drives.act(due, self._body.joints(), self._body.imu()))
        self._body.advance(until)


def walk(load: Load, seed: int, seconds: float, fidelity: Fidelity, delay: float) -> Outcome:
    """A robot walks for so many seconds, told speeds and turns as navigation gives them; the motors have so much delay (s)."""
    robot = _Robot(seed, fidelity, delay)
    random, told, fallen = np.random.default_rng([seed, 45]), 0.0, None
    ages: list[float] = []
    most = Limits()
    for turn in turns(load, seed, seconds):
        if turn.at >= told:
            told += CHANGE
            forward = random.uniform(SLOWEST, most.vx_max) if random.uniform() > STEPPING else 0.0
            robot.command(forward, random.uniform(-most.wz_max, most.wz_max) if random.uniform() > STRAIGHT else 0.0)
        robot.step(turn)
        ages.append(turn.at - turn.samples[-1] * PERIOD)
        if robot.fallen:
            fallen = turn.at
            break
    return Outcome(fallen, float(np.quantile(ages, 0.5)), float(np.quantile(ages, 0.99)), robot.taken_over)
