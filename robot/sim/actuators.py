"""The drives as they are: torque falls with speed, the bus gives so much current, windings get warm, and a hot drive gives less."""

from __future__ import annotations

import numpy as np

from robot.geometry.vectors import Vector
from robot.model.actuators import NOMINAL_VOLTAGE, ActuatorDesign

_KNEES = slice(2, None, 3)


class Actuators:
    """Twelve drives of one design on one bus, in the order of the joints.

    Invariants: no temperature is below that of the air; torques within `bounds` neither exceed a drive's limit nor, all together, the bus.
    """

    __slots__ = ("_design", "_housing", "_no_load", "_voltage", "_winding")

    def __init__(self, design: ActuatorDesign) -> None:
        self._design = design
        self._winding = np.full(12, design.ambient)
        self._housing = np.full(12, design.ambient)
        self._no_load = np.full(12, design.no_load)
        self._voltage = 1.0

    def __repr__(self) -> str:
        return f"<Actuators: the hottest {float(self._winding.max()):.1f} C, {float(self.left.min()):.0%} of its torque left>"

    @property
    def temperature(self) -> Vector:
        """Of the windings, C, shape (12,)."""
        return self._winding.copy()

    @property
    def left(self) -> Vector:
        """Share of its torque limit that heat leaves to each drive, shape (12,)."""
        design = self._design
        share = (design.derate_to - self._winding) / (design.derate_to - design.derate_from)
        return _clipped(share, 0.0, 1.0)

    def supply(self, voltage: float) -> None:
        """The bus has this share of its nominal voltage from now on: no-load speeds and the bus's power go with it."""
        self._voltage = voltage

    def bounds(self, peak: Vector, speed: Vector, wanted: Vector) -> tuple[Vector, Vector]:
        """Least and largest torque (N m) of each drive now, shape (12,) each.

        `peak` is each drive's limit at rest and cold, `speed` how fast the joints turn (rad/s), `wanted` the torque asked for. A drive
        brakes with its whole limit at any speed. When what is wanted would overload the bus, all torques are taken back by one factor.
        """
        self._no_load[_KNEES] = self._design.knee_product / peak[_KNEES]
        line = self._design.stall * peak
        turning = line * speed / (self._no_load * self._voltage)
        most = peak * self.left
        high = _clipped(line - turning, 0.0, most)
        low = -_clipped(line + turning, 0.0, most)
        given = _clipped(wanted, low, high)
        share = self._bus_share(given, speed)
        if share < 1.0:
            given *= share
            high = np.where(given > 0.0, given, high)
            low = np.where(given < 0.0, given, low)
        return low, high

    def warm(self, dt: float, torque: Vector) -> None:
        """Let `dt` seconds of these torques (N m) pass: copper loss heats the winding, it the housing, and that the air."""
        design = self._design
        inward = (self._winding - self._housing) / design.winding_resistance
        outward = (self._housing - design.ambient) / design.housing_resistance
        self._winding += dt / design.winding_capacity * (design.copper_loss * torque * torque - inward)
        self._housing += dt / design.housing_capacity * (inward - outward)

    def _bus_share(self, torque: Vector, speed: Vector) -> float:
        """The largest factor, up to 1, on all of these torques with which the bus carries them: copper loss goes with its square."""
        most = self._design.bus_current * NOMINAL_VOLTAGE * self._voltage
        work = float(np.maximum(torque * speed, 0.0).sum())
        loss = self._design.copper_loss * float(torque.dot(torque))
        if work + loss <= most:
            return 1.0
        return float(2.0 * most / (work + (work * work + 4.0 * loss * most) ** 0.5))


def _clipped(values: Vector, low: Vector | float, high: Vector | float) -> Vector:
    """As `np.clip`, which for a dozen values costs three times as much."""
    return np.minimum(np.maximum(values, low), high)
