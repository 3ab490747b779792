"""The battery service as the tutorial defines it: a gauge that reads a percentage off the voltage of a three-cell pack.

It is a voltage gauge, not a state of charge: under a load of 400 W it reads about 8 points off, and 0 while a tenth
of the charge is left. The robot's own decisions use `robot.estimation.battery_levels` and the coulomb count; this contract is
kept for those who call the service.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

EMPTY_VOLTAGE, VOLTAGE_SPAN = 10.0, 2.6
"""Of three cells, V: where the gauge reads 0, and from there to where it reads 100. These five are the tutorial's."""
FULL = 100.0
"""Per cent."""
MINUTES_PER_POINT = 1.2
GOOD, LOW = 50.0, 20.0
"""Per cent."""


class UnknownRobot(LookupError):
    """The battery of a robot was asked for that this gauge does not watch."""


@dataclass(frozen=True, slots=True)
class GaugeReading:
    """The answer of the service, field by field."""

    voltage: float
    percentage: float
    estimated_runtime_minutes: float
    """1.2 min per point, off the charger: while charging it is the time that unplugging now would leave."""
    health_status: str
    is_charging: bool


def percentage(voltage: float) -> float:
    """``(V - 10) / 2.6 * 100`` clamped to 0..100, for the voltage of a three-cell pack: 12.6 V is 100, 10.0 V is 0."""
    if not math.isfinite(voltage):
        raise ValueError(f"The battery voltage is {voltage!r}, so no percentage can be read from it: check the sensor.")
    return min(FULL, max(0.0, (voltage - EMPTY_VOLTAGE) / VOLTAGE_SPAN * FULL))


def runtime_minutes(percent: float) -> float:
    """1.2 minutes for each point of the gauge."""
    return percent * MINUTES_PER_POINT


def health(percent: float) -> str:
    """``good`` above 50, ``low`` above 20, else ``critical``.

    Compared after rounding to 1e-6, because the formula gives 50.00000000000002 for the 11.3 V that mean exactly 50.
    """
    rounded = round(percent, 6)
    if rounded > GOOD:
        return "good"
    return "low" if rounded > LOW else "critical"


class BatteryGauge:
    """Answers for the robots it knows; an unknown `robot_id` is refused by name."""

    __slots__ = ("_robots",)

    def __init__(self, robots: Collection[str] = ("robot_01",)) -> None:
        self._robots = tuple(robots)

    def read(self, robot_id: str, voltage: float, *, is_charging: bool = False) -> GaugeReading:
        """The reading for `voltage` V (of three cells: see `PackState.gauge_voltage`).

        Raises `UnknownRobot` for a robot that is not watched, `ValueError` for a voltage that is no number.
        """
        if robot_id not in self._robots:
            known = ", ".join(repr(robot) for robot in self._robots)
            raise UnknownRobot(f"No battery is known for robot {robot_id!r}; this gauge watches {known}.")
        percent = percentage(voltage)
        return GaugeReading(
            voltage=voltage,
            percentage=percent,
            estimated_runtime_minutes=runtime_minutes(percent),
            health_status=health(percent),
            is_charging=is_charging,
        )
