"""One stop, or one failure of a sensor, in physics: a robot that walks, what happens to it, and what becomes of it.

Every case is a robot of its own that walks from the start, so cases may run in any order and in any process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, TypeAlias

import numpy as np

from robot.control.gait_controller import GaitController
from robot.control.gaits import GAITS, GaitClock
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.link.firmware import Drives
from robot.model.modes import ON_ITS_FEET
from robot.testing import FAULTS, PERIOD, Conditions, Trial

__all__ = ["CAUSES", "FAULTY", "Case", "Outcome", "run"]

AFTERWARDS: Final = 4.0
"""Seconds for which a robot is looked at after the failure: a walk has come to rest and sits by then."""
SETTLE: Final = 2.0
"""Seconds for which it walks before, and as many more as its speed in m/s."""
LONGEST_HANG: Final = 0.4
"""Seconds; one that lasts longer ends with the control process killed, which is a gait that is silent, and later restarted."""
LONGEST_RESTART: Final = 0.1
"""Seconds that a restart of a node takes at most (docs/robot.md#the-tree)."""

Random: TypeAlias = np.random.Generator


@dataclass(frozen=True, slots=True)
class Case:
    """One robot, and what happens to it."""

    cause: str
    """One of `CAUSES`, or a fault of `robot.testing.FAULTS`."""
    speed: float
    """Commanded, m/s forward."""
    phase: float
    """When it happens, as a share of a stride."""
    seed: int
    delay: float
    """Of the motors, s."""
    turn: float = 0.0
    """Commanded, rad/s."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of it."""

    fallen: bool
    found: float | None
    """Seconds from the failure until the robot knew of it; None if it never did."""
    detail: str
    """What exactly failed."""


def run(case: Case) -> Outcome:
    """Walk as the case says, let it happen, and look on. Raises `LookupError` for a cause that is none."""
    random = np.random.default_rng([case.seed, round(1000 * case.phase), round(1000 * case.speed)])
    trial = Trial(int(random.integers(1 << 31)), conditions=Conditions(delay=case.delay))
    trial.stand_up()
    clock = GaitClock(GAITS["trot"])
    clock.hurry(case.speed)
    command = (case.speed, 0.0, case.turn)
    trial.run(SETTLE + case.speed + case.phase * clock.period, command)
    if trial.fallen:
        return Outcome(True, None, "before anything happened")
    happen = CAUSES.get(case.cause)
    return happen(trial, random) if happen is not None else _spoilt(trial, case.cause)


# -- sensors ----------------------------------------------------------------------------------------------------------


def _spoilt(trial: Trial, fault: str) -> Outcome:
    """A sensor fails and stays so; found is when the gait controller says that it has lost one."""
    trial.spoil(fault)
    found = None
    for step in range(round(AFTERWARDS / PERIOD)):
        trial.step()
        if found is None and trial.gait.lost:
            found = step * PERIOD
        if trial.fallen:
            break
    return Outcome(trial.fallen, found, fault)


def _one_of(*words: str) -> Callable[[Trial, Random], Outcome]:
    """One of the faults whose names hold all of `words`."""
    names = [name for name in FAULTS if all(word in name for word in words)]
    return lambda trial, random: _spoilt(trial, names[random.integers(len(names))])


# -- whoever commands the drives --------------------------------------------------------------------------------------


class _Loop:
    """The control loop of a robot whose targets may fail to come: its drives then act by themselves.

    Invariant: one `period` is one control period of the body.
    """

    def __init__(self, trial: Trial) -> None:
        self.body, self.gait = trial.body, trial.gait
        self.fallen = False
        self._drives = Drives()
        self._drives.obey(self.body.time, 1)

    @property
    def stopping(self) -> bool:
        """Whether the drives act by themselves."""
        return self._drives.stopping

    def sample(self) -> tuple[ImuSample, JointSample]:
        return self.body.imu(), self.body.joints()

    def period(self, targets: MotorTargets | None) -> None:
        """One control period with these targets; None: nobody gives any."""
        body, now = self.body, self.body.time
        if targets is not None:
            self._drives.obey(now, 1)
            body.command(targets)
        elif (due := self._drives.due()) is not None and due <= now + 0.5 * PERIOD:
            body.command(self._drives.act(now, body.joints(), body.imu()))
        body.advance(now + PERIOD)
        truth = body.truth()
        lying = truth.lying and targets is not None and self.gait.mode in ON_ITS_FEET
        self.fallen = self.fallen or truth.fallen or lying

    def silent(self, seconds: float) -> float | None:
        """Nobody gives targets for so long; returns after how many seconds the drives acted."""
        begun, acted = self.body.time, None
        for _ in range(round(seconds / PERIOD)):
            self.period(None)
            if acted is None and self.stopping:
                acted = self.body.time - PERIOD - begun
        return acted

    def walk_on(self) -> None:
        """The gait controller goes on, with fresh samples."""
        for _ in range(round(AFTERWARDS / PERIOD)):
            self.period(self.gait.step(PERIOD, *self.sample()))


def _gait_silent(trial: Trial, random: Random) -> Outcome:
    loop = _Loop(trial)
    found = loop.silent(AFTERWARDS)
    return Outcome(loop.fallen, found, "no targets any more")


def _gait_restarted(trial: Trial, random: Random) -> Outcome:
    """A new gait controller that knows nothing meets a robot that walks."""
    gap = float(random.uniform(0.0, LONGEST_RESTART))
    loop = _Loop(trial)
    loop.silent(gap)
    loop.gait = GaitController(motor_delay=0.0)
    loop.walk_on()
    return Outcome(loop.fallen, gap, f"a new gait controller after {gap:.3f} s")


def _motors_restarted(trial: Trial, random: Random) -> Outcome:
    """The targets of the gait controller are lost for a moment; it does not know, and walks on."""
    gap = float(random.uniform(0.0, LONGEST_RESTART))
    loop = _Loop(trial)
    for _ in range(round(gap / PERIOD)):
        loop.gait.step(PERIOD, *loop.sample())
        loop.period(None)
    loop.walk_on()
    return Outcome(loop.fallen, gap, f"targets lost for {gap:.3f} s")


def _hang(trial: Trial, random: Random) -> Outcome:
    """The loop of the whole controller is held up; then it takes in all samples that have waited for it at once, and walks on."""
    gap = float(random.uniform(0.0, LONGEST_HANG))
    loop = _Loop(trial)
    waiting: list[tuple[ImuSample, JointSample]] = []
    acted = None
    for step in range(round(gap / PERIOD)):
        waiting.append(loop.sample())
        loop.period(None)
        if acted is None and loop.stopping:
            acted = step * PERIOD
    for imu, joints in waiting:
        loop.gait.step(PERIOD, imu, joints)
    loop.walk_on()
    return Outcome(loop.fallen, acted, f"held up for {gap:.3f} s")


CAUSES: Final[Mapping[str, Callable[[Trial, Random], Outcome]]] = MappingProxyType(
    {
        "gait silent": _gait_silent,
        "gait restarted": _gait_restarted,
        "encoder lost": _one_of("encoder"),
        "IMU lost": _one_of("IMU"),
        "hang": _hang,
        "motors restarted": _motors_restarted,
    }
)
"""What may happen to a robot that walks, by name."""
FAULTY: Final = tuple(FAULTS)
"""The faults that are drawn from, by name."""
