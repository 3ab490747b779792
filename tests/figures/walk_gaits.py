"""Measurements of the gaits beside the trot, of changes between gaits, of slippery ground and of failing sensors; physics back end."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from math import degrees

import numpy as np

from robot.control.gaits import GAITS
from robot.testing import FAULTS, Conditions, Record, Trial


def _walked(seed: int, given: Conditions, gait: str, speed: float) -> Record | None:
    """Eight seconds of straight walking, settled; None after a fall."""
    trial = Trial(seed, conditions=given, gait=gait)
    trial.stand_up()
    trial.run(3.0 + speed / 1.5, (speed, 0.0, 0.0))
    record = trial.run(8.0, (speed, 0.0, 0.0))
    return None if trial.fallen else record


def speed_error(seed: int, given: Conditions, gait: str, speed: float) -> float:
    """By how much the mean true speed misses the one commanded, per cent of it; infinite after a fall."""
    record = _walked(seed, given, gait, speed)
    return float("inf") if record is None else float(abs(record.velocity[:, 0].mean() / speed - 1.0) * 100.0)


def sway(seed: int, given: Conditions, gait: str, speed: float) -> float:
    """Standard deviation of roll or pitch, whichever is larger, degrees; infinite after a fall."""
    record = _walked(seed, given, gait, speed)
    return float("inf") if record is None else degrees(float(record.lean.std(axis=0).max()))


def switch_falls(seed: int, given: Conditions, speed: float = 0.5) -> float:
    """Falls in changes from each gait to each other at `speed` (m/s), begun at a random moment of a curved walk; 3 s afterwards."""
    random = np.random.default_rng([seed, 20])
    fallen = 0
    for before, after in permutations(GAITS, 2):
        trial = Trial(seed, conditions=given, gait=before)
        trial.stand_up()
        command = (speed, 0.0, random.uniform(-0.4, 0.4))
        trial.run(2.0 + random.uniform(0.0, 1.0), command)
        trial.gait.select_gait(after)
        trial.run(3.0, command)
        fallen += trial.fallen or trial.gait.gait != after
    return float(fallen)


def slippery_falls(seed: int, given: Conditions, friction: float, speed: float) -> float:
    """Falls in 10 s on a floor of this friction, or a speed that is missed by more than 10 per cent."""
    trial = Trial(seed, conditions=replace(given, friction=friction))
    trial.stand_up()
    trial.run(2.0, (speed, 0.0, 0.0))
    record = trial.run(8.0, (speed, 0.0, 0.0))
    return float(trial.fallen or abs(record.velocity[:, 0].mean() / speed - 1.0) > 0.1)


def fault_falls(seed: int, given: Conditions, speed: float = 0.5) -> float:
    """Falls within 3 s of each way in which a sensor fails, at a random moment of a walk at `speed` (m/s)."""
    random = np.random.default_rng([seed, 21])
    fallen = 0
    for fault in FAULTS:
        trial = Trial(seed, conditions=given)
        trial.stand_up()
        command = (speed, 0.0, random.uniform(-0.3, 0.3))
        trial.run(2.0 + random.uniform(0.0, 0.5), command)
        trial.spoil(fault)
        trial.run(3.0)
        fallen += trial.fallen
    return float(fallen)
