"""For tests of the walking robot: put it into a world, push it, take a sensor away, and look at what became of it.

Needs MuJoCo. For tests of its nodes use `robot.Robot` with `actors.testing`.
"""

from robot.testing.faults import FAULTS, GYRO_FAULTS, GyroFault, Spoil, wrong_gyro
from robot.testing.trial import FLAT, PERIOD, Conditions, Record, Trial

__all__ = [
    "FAULTS",
    "FLAT",
    "GYRO_FAULTS",
    "PERIOD",
    "Conditions",
    "GyroFault",
    "Record",
    "Spoil",
    "Trial",
    "wrong_gyro",
]
