"""How long the battery will last at the present load."""

from __future__ import annotations

import math

import numpy as np

from robot.battery.design import EMPTY_VOLTAGE, GAUGE_CELLS, PackDesign
from robot.battery.model import HEAT_CAPACITY, THERMAL_RESISTANCE, PackState

__all__ = ["MeanLoad", "RuntimeEstimator"]

TYPICAL_LOAD = 403.0
"""W: 605 Wh in the 90 min of typical use."""
SLOW, FAST = 60.0, 10.0
CHANGE, PATIENCE = 0.10, 30.0
_GRID = np.linspace(0.0, 1.0, 65)


class MeanLoad:
    """The load averaged exponentially over 60 s, seeded with the typical 403 W.

    A mean of 60 s still holds 13.5 % of an old load after two minutes. So it starts afresh from a mean of 10 s, and
    grows its window back to 60 s, when the two differ by more than 10 % for 30 s on end: a lasting change is
    followed, a flight of stairs is averaged away.
    """

    __slots__ = ("_apart", "_fast", "_slow", "_window")

    def __init__(self) -> None:
        self._slow = self._fast = TYPICAL_LOAD
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
    which 10.0 V is reached under this load up to the present charge, at the temperature expected half-way. The
    textbook quotient of stored energy and mean power ignores what the pack's resistance takes and the charge that
    this load cannot draw, which near the end is half of what is left. `ambient` is the air temperature, C.
    """

    __slots__ = ("ambient", "design", "load")

    def __init__(self, design: PackDesign, *, ambient: float = 25.0) -> None:
        self.design = design
        self.ambient = ambient
        self.load = MeanLoad()

    def update(self, dt: float, power_w: float) -> None:
        """Take in a load of `power_w` W, hotel load included, that lasted `dt` seconds."""
        self.load.update(dt, power_w)

    def seconds(self, state: PackState) -> float:
        """Run time left from `state`, taken off the charger now; 0 below 10.0 V, infinite without any load."""
        power = self.load.watts
        if power <= 0.0:
            return math.inf
        time, current = self._discharge(power, state.soc, state.temperature)
        for _ in range(2):  # warming shortens the time by a few percent at most, so this settles at once
            heat = current * current * self.design.steady_resistance(state.temperature)
            settled = self.ambient + heat * THERMAL_RESISTANCE
            decay = math.exp(-0.5 * time / (HEAT_CAPACITY * THERMAL_RESISTANCE))
            time, current = self._discharge(power, state.soc, settled + (state.temperature - settled) * decay)
        return time

    def _discharge(self, power: float, soc: float, temperature: float) -> tuple[float, float]:
        """Seconds down to the limit at a constant load and temperature, and the mean current, A."""
        resistance = self.design.steady_resistance(temperature)
        limit = EMPTY_VOLTAGE * self.design.series_cells / GAUGE_CELLS
        empty = self.design.charge_at(limit + resistance * power / limit)
        if soc <= empty:
            return 0.0, 0.0
        grid = empty + (soc - empty) * _GRID
        emf = self.design.open_voltages(grid)
        current = 2.0 * power / (emf + np.sqrt(np.maximum(emf * emf - 4.0 * resistance * power, 0.0)))
        hours = np.diff(grid) @ (0.5 / current[1:] + 0.5 / current[:-1]) * self.design.capacity(temperature)
        return 3600.0 * float(hours), float(current.mean())
