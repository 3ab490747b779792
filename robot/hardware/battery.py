"""What a battery pack's own electronics report."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from robot.model.battery import GAUGE_CELLS


class SupplyStatus(IntEnum):
    """What the pack is doing, with the numbers of ``sensor_msgs/BatteryState.power_supply_status``."""

    UNKNOWN = 0
    CHARGING = 1
    DISCHARGING = 2
    NOT_CHARGING = 3
    FULL = 4


@dataclass(frozen=True, slots=True)
class PackState:
    """What the pack's own electronics report at one instant."""

    voltage: float
    """At the terminals, V."""
    current: float
    """A; negative when discharging, as in ``sensor_msgs/BatteryState``."""
    charge: float
    """Ah left by coulomb count."""
    capacity: float
    """Ah that a full pack would hold at this temperature."""
    temperature: float
    """Degrees Celsius."""
    soc: float
    """State of charge by coulomb count, 0..1."""
    status: SupplyStatus
    supplied: bool
    """Whether the load got all the power it asked for; false when the pack is empty or overloaded."""
    cells: int

    @property
    def percent(self) -> float:
        """State of charge by coulomb count, 0..100. It is not the reading of the voltage gauge."""
        return 100.0 * self.soc

    @property
    def gauge_voltage(self) -> float:
        """The voltage a pack of three cells would show, V: voltage gauge and 10.0 V limit are written for it."""
        return self.voltage * GAUGE_CELLS / self.cells
