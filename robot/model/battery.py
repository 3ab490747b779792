"""How a battery pack is built: cells, capacity, resistance, and how they change with charge and temperature.

The open-circuit table is that of a typical NMC cell. Nominal values follow the maker's sheet of the robot: 605 Wh,
charged by 400 W. The default of three series cells puts the pack at 9.0 to 12.6 V, the range that the battery gauge
is made for; the sheet's own pack is 58.8 V, which is 14 cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robot.geometry.vectors import Vector
from robot.model.robot import RobotModel

NOMINAL_CELL_VOLTAGE = 3.7
FULL_CELL_VOLTAGE = 4.2
GAUGE_CELLS = 3
"""The battery gauge and the 10.0 V limit are written for a pack of three cells."""
HEAT_CAPACITY = 3000.0
"""J/K."""
THERMAL_RESISTANCE = 2.0
"""K/W to the ambient air."""
EMPTY_VOLTAGE = 10.0
"""Of a pack of three cells, under load: the robot stops here."""

_SOC = np.array([0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0])
_OCV = np.array([3.00, 3.30, 3.45, 3.56, 3.62, 3.67, 3.73, 3.81, 3.91, 4.00, 4.09, 4.13, 4.20])


@dataclass(frozen=True, slots=True)
class PackDesign:
    """A pack of `series_cells` cells in series that holds `energy_wh` Wh at the nominal 3.7 V per cell.

    Packs of different cell counts but equal energy are the same battery, wired differently: power, heat and run
    time agree.
    """

    series_cells: int = 3
    energy_wh: float = 605.0
    resistivity: float = 0.09083
    """Resistance of one cell times its capacity at 25 C, ohm Ah: 30 mOhm for a 3 Ah cell, 5 mOhm by default."""
    relaxation: bool = False
    """One RC pair of R/2 and 30 s: the voltage sags on for half a minute under a new load, and recovers after it."""
    charger_power: float = 400.0
    """What the dock delivers at the pack's terminals, W."""

    @classmethod
    def of(cls, model: RobotModel) -> PackDesign:
        """The pack of a robot: as much energy for its mass as the reference body has, and charged in the same time."""
        own = cls()
        return cls(energy_wh=own.energy_wh * model.force, charger_power=own.charger_power * model.force)

    def __post_init__(self) -> None:
        if self.series_cells < 1 or not (math.isfinite(self.energy_wh) and self.energy_wh > 0.0):
            raise ValueError(
                f"A battery pack needs at least one series cell and a positive energy, not {self.series_cells!r} cells "
                f"and {self.energy_wh!r} Wh."
            )

    @property
    def design_capacity(self) -> float:
        """Capacity at 25 C, Ah."""
        return self.energy_wh / self.nominal_voltage

    @property
    def nominal_voltage(self) -> float:
        """Of all cells in series, V."""
        return self.series_cells * NOMINAL_CELL_VOLTAGE

    @property
    def charger_current(self) -> float:
        """The dock's current limit, A: 7 A into the sheet's 14 cells for 400 W, and the same power into any other wiring."""
        return 7.0 * 14.0 / self.series_cells * self.charger_power / 400.0

    @property
    def full_voltage(self) -> float:
        """The voltage that charging holds at the end, V."""
        return self.series_cells * FULL_CELL_VOLTAGE

    def open_voltage(self, soc: float) -> float:
        """Pack voltage without load at a state of charge of 0..1, V; linear between the knots of the cell table."""
        return self.series_cells * float(np.interp(soc, _SOC, _OCV))

    def open_voltages(self, soc: Vector) -> Vector:
        """`open_voltage` for many states of charge at once."""
        return np.asarray(self.series_cells * np.interp(soc, _SOC, _OCV), dtype=np.float64)

    def charge_at(self, open_voltage: float) -> float:
        """The state of charge, 0..1, at which the pack without load has `open_voltage` V."""
        return float(np.interp(open_voltage / self.series_cells, _OCV, _SOC))

    def resistance(self, temperature: float) -> float:
        """Series resistance of the pack at `temperature` C, ohm: two percent more for each degree colder than 25 C."""
        at_25 = self.series_cells * self.resistivity / self.design_capacity
        return at_25 * math.exp(0.02 * (25.0 - temperature))

    def steady_resistance(self, temperature: float) -> float:
        """What a lasting load meets, ohm: the series resistance and, with relaxation, the RC pair's."""
        return self.resistance(temperature) * (1.5 if self.relaxation else 1.0)

    def capacity(self, temperature: float) -> float:
        """Usable capacity at `temperature` C, Ah: 0.6 % less for each degree below 25 C."""
        return self.design_capacity * (1.0 - 0.006 * max(0.0, 25.0 - temperature))
