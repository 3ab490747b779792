"""One stop, or one failure of a sensor, in physics: a robot that walks, what happens to it, and how it ends.

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
from robot.model.modes import ON_ITS_FEET, Mode
from robot.sim.physics import PhysicsBody
from robot.testing import FAULTS, GYRO_FAULTS, PERIOD, Trial, wrong_gyro
from tests.figures.fidelity import IDEAL, Fidelity

AFTERWARDS: Final = 4.0
"""Seconds for which a robot is looked at after the failure, at most: a walk has come to rest and sits by then."""
AT_REST: Final = 0.5
"""Seconds for which it is looked at once it sits or stands."""
SETTLE: Final = 1.0
"""Seconds for which it walks before, and as many more as its speed in m/s: it has reached it for half a second by then."""
RESTING: Final = (Mode.SIT, Mode.STAND)
STILL: Final = 0.1
"""A body slower than this is at rest, m/s."""
LONGEST_HANG: Final = 0.4
"""Seconds; one that lasts longer ends with the control process killed, which is a gait that is silent, and later restarted."""
LONGEST_RESTART: Final = 0.1
"""Seconds that a restart of a node takes at most (docs/reference/robot.md#the-tree)."""
SCALES: Final = ((-2.0, 0.0), (2.0, 3.0))
"""What a gyro's axis that is wrong by a factor shows of the truth: from one of these ranges."""
OFFSETS: Final = (0.2, 1.0)
"""How much one that is wrong by an offset shows, rad/s, either way."""

Random: TypeAlias = np.random.Generator
Happening: TypeAlias = "Callable[[Trial, Random, float], Outcome]"
"""What happens to a robot that walks, and how it ends; the number is the motor delay, s."""


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
    fidelity: Fidelity = IDEAL


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
    trial = Trial(int(random.integers(1 << 31)), conditions=case.fidelity.conditions(case.delay))
    trial.stand_up()
    clock = GaitClock(GAITS["trot"])
    clock.hurry(case.speed)
    command = (case.speed, 0.0, case.turn)
    trial.run(SETTLE + case.speed + case.phase * clock.period, command)
    if trial.fallen:
        return Outcome(True, None, "before anything happened")
    happen = CAUSES.get(case.cause)
    return happen(trial, random, case.delay) if happen is not None else _spoilt(trial, case.cause)


class _Rest:
    """Whether a body has been at rest for `AT_REST` seconds. Call it once a control period."""

    def __init__(self, body: PhysicsBody) -> None:
        self._body, self._periods = body, 0

    def __call__(self, resting: bool) -> bool:
        """`resting` says that it is meant to be."""
        still = resting and float(np.linalg.norm(self._body.truth().velocity)) < STILL
        self._periods = self._periods + 1 if still else 0
        return self._periods * PERIOD > AT_REST


# -- sensors ----------------------------------------------------------------------------------------------------------


def _spoilt(trial: Trial, fault: str) -> Outcome:
    """A sensor fails and stays so; found is when the gait controller says that it has lost one."""
    trial.spoil(fault)
    return _watched(trial, fault)


def _watched(trial: Trial, detail: str) -> Outcome:
    """Go on until the robot has come to rest or fallen."""
    rest, found = _Rest(trial.body), None
    for step in range(round(AFTERWARDS / PERIOD)):
        trial.step()
        if found is None and trial.gait.lost:
            found = step * PERIOD
        if trial.fallen or rest(trial.gait.mode in RESTING):
            break
    return Outcome(trial.fallen, found, detail)


def _one_of(*words: str) -> Happening:
    """One of the faults whose names hold all of `words`."""
    names = [name for name in FAULTS if all(word in name for word in words)]
    return lambda trial, random, delay: _spoilt(trial, names[random.integers(len(names))])


def _gyro_wrong(trial: Trial, random: Random, delay: float) -> Outcome:
    """The gyro is wrong about one axis and stays so, plausibly."""
    kind, axis = GYRO_FAULTS[random.integers(len(GYRO_FAULTS))], int(random.integers(3))
    amount = 0.0
    if kind == "scaled":
        amount = float(random.uniform(*SCALES[random.integers(len(SCALES))]))
    elif kind == "offset":
        amount = float(random.choice((-1.0, 1.0)) * random.uniform(*OFFSETS))
    trial.spoil(wrong_gyro(kind, axis, amount))
    return _watched(trial, f"gyro {'xyz'[axis]} {kind} {amount:.2f}")


# -- what commands the drives --------------------------------------------------------------------------------------


class _Loop:
    """The control loop of a robot whose targets may fail to come: its drives then act by themselves.

    Invariant: the sensors are sampled once per control period, whatever commands: what comes late comes late by time.
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

    def _advance(self, targets: MotorTargets | None, commanded: bool) -> None:
        """One control period; None: the drives hold what they were told last."""
        body = self.body
        if targets is not None:
            body.command(targets)
        body.advance(body.time + PERIOD)
        truth = body.truth()
        lying = truth.lying and commanded and self.gait.mode in ON_ITS_FEET
        self.fallen = self.fallen or truth.fallen or lying

    def silent(
        self, seconds: float, meanwhile: Callable[[ImuSample, JointSample], object] = lambda imu, joints: None
    ) -> float | None:
        """Nobody gives targets for so long, while `meanwhile` gets the samples; returns after how many seconds the drives acted."""
        rest, acted = _Rest(self.body), None
        for step in range(round(seconds / PERIOD)):
            imu, joints = self.sample()
            meanwhile(imu, joints)
            due, now = self._drives.due(), self.body.time
            acts = due is not None and due <= now + 0.5 * PERIOD
            self._advance(self._drives.act(now, joints, imu) if acts else None, False)
            if acted is None and self.stopping:
                acted = step * PERIOD
            if self.fallen or rest(self._drives.resting):
                break
        return acted

    def walk_on(self) -> None:
        """The gait controller goes on, with fresh samples."""
        rest = _Rest(self.body)
        for _ in range(round(AFTERWARDS / PERIOD)):
            self._drives.obey(self.body.time, 1)
            self._advance(self.gait.step(PERIOD, *self.sample()), True)
            if self.fallen or rest(self.gait.mode in RESTING):
                break


def _gait_silent(trial: Trial, random: Random, delay: float) -> Outcome:
    loop = _Loop(trial)
    found = loop.silent(AFTERWARDS)
    return Outcome(loop.fallen, found, "no targets any more")


def _gait_restarted(trial: Trial, random: Random, delay: float) -> Outcome:
    """A new gait controller that knows nothing meets a robot that walks."""
    gap = float(random.uniform(0.0, LONGEST_RESTART))
    loop = _Loop(trial)
    found = loop.silent(gap)
    loop.gait = GaitController(motor_delay=delay)
    loop.walk_on()
    return Outcome(loop.fallen, found, f"a new gait controller after {gap:.3f} s")


def _motors_restarted(trial: Trial, random: Random, delay: float) -> Outcome:
    """The targets of the gait controller are lost for a moment; it does not know, and walks on."""
    gap = float(random.uniform(0.0, LONGEST_RESTART))
    loop = _Loop(trial)
    acted = loop.silent(gap, lambda imu, joints: loop.gait.step(PERIOD, imu, joints))
    loop.walk_on()
    return Outcome(loop.fallen, acted, f"targets lost for {gap:.3f} s")


def _hang(trial: Trial, random: Random, delay: float) -> Outcome:
    """The loop of the whole controller is held up; then it takes in all samples that have waited for it at once, and walks on."""
    gap = float(random.uniform(0.0, LONGEST_HANG))
    loop = _Loop(trial)
    waiting: list[tuple[ImuSample, JointSample]] = []
    acted = loop.silent(gap, lambda imu, joints: waiting.append((imu, joints)))
    if loop.stopping:
        loop.gait.overtake()
    for imu, joints in waiting:
        if loop.gait.overtaken:
            loop.gait.follow(PERIOD, imu, joints)
        else:
            loop.gait.step(PERIOD, imu, joints)
    loop.walk_on()
    return Outcome(loop.fallen, acted, f"held up for {gap:.3f} s")


CAUSES: Final[Mapping[str, Happening]] = MappingProxyType(
    {
        "gait silent": _gait_silent,
        "gait restarted": _gait_restarted,
        "encoder lost": _one_of("encoder"),
        "IMU lost": _one_of("IMU"),
        "gyro wrong": _gyro_wrong,
        "hang": _hang,
        "motors restarted": _motors_restarted,
    }
)
"""What may happen to a robot that walks, by name."""
FAULTY: Final = tuple(FAULTS)
"""The faults that are drawn from, by name."""
