"""How long the battery will last at the present load."""

from __future__ import annotations

import math

import numpy as np

from robot.hardware.battery import PackState
from robot.model.battery import EMPTY_VOLTAGE, GAUGE_CELLS, HEAT_CAPACITY, THERMAL_RESISTANCE, PackDesign
from robot.model.power import HOUR

TYPICAL_TIME = 1.5
"""Hours that a pack lasts in typical use: 605 Wh at 403 W."""
SLOW, FAST = 60.0, 6.0
CHANGE, PATIENCE = 0.04, 30.0
ROOM = 25.0
"""Temperature of the air unless it is known, C."""
_GRID = np.linspace(0.0, 1.0, 65)


class MeanLoad:
    """The load averaged exponentially over 60 s, seeded with a `typical` one, W.

    A mean of 60 s still holds 13.5 % of an old load after two minutes. So it starts afresh from a mean of 6 s, and
    grows its window back to 60 s, when the two differ by more than 4 % for 30 s on end: a lasting change is
    followed, a flight of stairs is averaged away.
    """

    __slots__ = ("_apart", "_fast", "_slow", "_window")

    def __init__(self, typical: float) -> None:
        self._slow = self._fast = typical
        self._window = SLOW
        self._apart = 0.0

    @property
    def watts(self) -> float:
        """The mean load now, W."""
        return self._slow

    def update(self, dt: float, power_w: float) -> float:
        """Take in a load of `power_w` W that lasted `dt` seconds; returns the new mean."""
        self._fast = power_w + (self._fast - power_w) * math.exp(-dt / FAST)
        self._slow = power_w + (self._slow - power_w) * math.exp(-dt / self._window)
        self._window = min(SLOW, self._window + dt)
        apart = abs(self._fast - self._slow) > CHANGE * self._slow
        self._apart = self._apart + dt if apart else 0.0
        if self._apart >= PATIENCE:
            self._slow, self._window, self._apart = self._fast, FAST, 0.0
        return self._slow


class RuntimeEstimator:
    """Seconds until the pack's voltage falls to 10.0 V (per three cells) if the present mean load goes on.

    That is the pack's own discharge law, solved for time: dt = 3600 C ds / I(s), integrated from the charge at
    which 10.0 V is reached under this load up to the present charge, while the pack warms as it must. The
    textbook quotient of stored energy and mean power ignores what the pack's resistance takes and the charge that
    this load cannot draw, which near the end is half of what is left. `ambient` is the air temperature, C.
    """

    __slots__ = ("ambient", "design", "load")

    def __init__(self, design: PackDesign, *, ambient: float = ROOM) -> None:
        self.design = design
        self.ambient = ambient
        self.load = MeanLoad(design.energy_wh / TYPICAL_TIME)

    def update(self, dt: float, power_w: float) -> None:
        """Take in a load of `power_w` W, hotel load included, that lasted `dt` seconds."""
        self.load.update(dt, power_w)

    def seconds(self, state: PackState) -> float:
        """Run time left from `state`, taken off the charger now; 0 below 10.0 V, infinite without any load."""
        power = self.load.watts
        if power <= 0.0:
            return math.inf
        time, begin, end = 0.0, state.temperature, state.temperature
        for _ in range(4):  # warming changes the time by a few percent at most, so this settles at once
            time, current = self._discharge(power, state.soc, begin, end)
            heat = current * current * self.design.steady_resistance(0.5 * (begin + end))
            settled = self.ambient + heat * THERMAL_RESISTANCE
            end = settled + (begin - settled) * math.exp(-time / (HEAT_CAPACITY * THERMAL_RESISTANCE))
        return time

    def energy_above(self, charge: float, state: PackState) -> float:
        """What the present mean load can draw at the terminals before `charge` (0..1), or 10.0 V if that comes first, is reached, Wh."""
        power, now = self.load.watts, state.temperature
        return power * self._discharge(power, state.soc, now, now, charge)[0] / HOUR

    def _discharge(self, power: float, soc: float, begin: float, end: float, floor: float = 0.0) -> tuple[float, float]:
        """Seconds down to the limit, or to the charge `floor`, at a constant load, and the mean current, A.

        The pack has the temperature `begin` now and `end` then, and in between in proportion to the charge.
        """
        first, last = self.design.steady_resistance(begin), self.design.steady_resistance(end)
        limit = EMPTY_VOLTAGE * self.design.series_cells / GAUGE_CELLS
        empty = max(floor, self.design.charge_at(limit + last * power / limit))
        if soc <= empty:
            return 0.0, 0.0
        grid = empty + (soc - empty) * _GRID
        emf, resistance = self.design.open_voltages(grid), last + (first - last) * _GRID
        root = np.sqrt(np.maximum(emf * emf - 4.0 * resistance * power, 0.0))  # formula: of R I^2 - E I + P = 0
        current = 2.0 * power / (emf + root)
        capacity = self.design.capacity(0.5 * (begin + end))
        hours = np.diff(grid) @ (0.5 / current[1:] + 0.5 / current[:-1]) * capacity
        return HOUR * float(hours), float(current.mean())
