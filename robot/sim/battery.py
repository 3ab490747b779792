"""The battery pack as it behaves: voltage under load, coulomb count, temperature, charging. Stepped by its owner.

Equations (docs/concepts/control.md#power-and-battery), current I positive when discharging:

    V = OCV(s) - I R(T) - V1           dV1/dt = (I R1 - V1) / 30 s, R1 = R/2, with `PackDesign.relaxation`
    ds/dt = -eta I / (3600 C(T))       eta = 1 discharging, 0.995 charging
    I = (E - sqrt(E^2 - 4 R P)) / 2R   for a load of constant power P, E = OCV(s) - V1
    3000 dT/dt = heat - (T - ambient) / 2
"""

from __future__ import annotations

import math

from robot.hardware.battery import PackState, SupplyStatus
from robot.model.battery import HEAT_CAPACITY, THERMAL_RESISTANCE, PackDesign

RELAXATION_TIME = 30.0
CHARGE_EFFICIENCY = 0.995
LONGEST_STEP = 1.0


class Pack:
    """Implements `BatteryDevice`: a battery pack with `percent` of its charge, at rest at the `ambient` temperature (C).

    ``series_cells=3`` reports 9.0..12.6 V, ``series_cells=14`` the 58.8 V of the robot's sheet; both hold 605 Wh.
    A `design` given takes the place of `series_cells`.

    Within a step the load is constant; steps longer than one second are cut into equal parts of at most one second.
    """

    __slots__ = ("_age", "_ambient", "_full", "_soc", "_temperature", "_v1", "design", "state")

    def __init__(
        self,
        percent: float = 100.0,
        series_cells: int = 3,
        *,
        ambient: float = 25.0,
        design: PackDesign | None = None,
    ) -> None:
        if not 0.0 <= percent <= 100.0:
            raise ValueError(f"A battery pack starts with a charge of 0 to 100 percent, not {percent!r}.")
        self.design = design if design is not None else PackDesign(series_cells=series_cells)
        self._soc = percent / 100.0
        self._temperature = self._ambient = ambient
        self._v1 = 0.0
        self._full = False
        self._age = 0.0
        self.state = self._report(current=0.0, supplied=True, charging=False)

    def __repr__(self) -> str:
        s = self.state
        reading = f"{s.percent:.1f} %, {s.voltage:.2f} V, {s.current:+.1f} A, {s.temperature:.1f} C"
        return f"<Pack of {s.cells} cells: {reading}>"

    def step(self, dt: float, power_w: float, charging: bool = False) -> PackState:
        """Let `dt` seconds pass under a load of `power_w` W (hotel load included) and return the state at their end.

        With `charging` the dock's charger carries the load first and charges with what is left of its 400 W, at
        constant current and then at constant voltage, until the current falls below C/20 (status FULL). A load
        beyond the charger discharges the pack all the same. An empty pack delivers nothing: see
        `PackState.supplied`.
        """
        if not (math.isfinite(dt) and dt >= 0.0 and math.isfinite(power_w) and power_w >= 0.0):
            raise ValueError(
                f"A battery step needs a finite time and a finite load of at least zero, "
                f"not {dt!r} s and {power_w!r} W."
            )
        self._age += dt
        parts = max(1, math.ceil(dt / LONGEST_STEP))
        for _ in range(parts):
            self._advance(dt / parts, power_w, charging)
        return self.state

    @property
    def serial_number(self) -> str:
        """That of a simulated pack of 605 Wh."""
        return "sim-605"

    @property
    def kept(self) -> tuple[float, ...]:
        """What a pack that is made again needs to go on from here: age (s), charge, temperature, relaxation, and whether it is full."""
        return self._age, self._soc, self._temperature, self._v1, float(self._full)

    def restore(self, kept: tuple[float, ...]) -> None:
        """Be the pack that `kept` tells of, unless this one is older, and so the same one later."""
        age, soc, temperature, v1, full = kept
        if age > self._age:
            self._age, self._soc, self._temperature, self._v1, self._full = age, soc, temperature, v1, bool(full)
            self.state = self._report(current=0.0, supplied=True, charging=False)

    def _advance(self, dt: float, power: float, charging: bool) -> None:
        resistance = self.design.resistance(self._temperature)
        if charging:
            current, supplied = self._charging_current(power, resistance)
        else:
            current, supplied = self._load_current(power, resistance)
        self._full = charging and self._full and current <= 0.0
        efficiency = CHARGE_EFFICIENCY if current < 0.0 else 1.0
        drawn = efficiency * current * dt / (3600.0 * self.design.capacity(self._temperature))
        self._soc = min(1.0, max(0.0, self._soc - drawn))
        self._warm(dt, current, resistance)
        self.state = self._report(current, supplied, charging)

    def _load_current(self, power: float, resistance: float) -> tuple[float, bool]:
        """Current for a load of constant power, A, and whether the pack can give that much."""
        if power == 0.0:
            return 0.0, True
        if self._soc <= 0.0:
            return 0.0, False
        emf = self.design.open_voltage(self._soc) - self._v1
        discriminant = emf * emf - 4.0 * resistance * power
        if discriminant < 0.0:
            return emf / (2.0 * resistance), False
        # the textbook form cancels to nothing for small loads; this one is exact there
        return 2.0 * power / (emf + math.sqrt(discriminant)), True

    def _charging_current(self, load: float, resistance: float) -> tuple[float, bool]:
        """Net current while docked, A (negative into the pack), and whether the load is carried."""
        left = self.design.charger_power - load
        if left < 0.0:
            return self._load_current(-left, resistance)
        if self._full:
            return 0.0, True
        emf = self.design.open_voltage(self._soc) - self._v1
        by_power = 2.0 * left / (emf + math.sqrt(emf * emf + 4.0 * resistance * left))
        by_current = self.design.charger_current
        by_voltage = max(0.0, (self.design.full_voltage - emf) / resistance)
        if by_voltage <= min(by_power, by_current) and by_voltage < self.design.design_capacity / 20.0:
            self._full = True
            return 0.0, True
        return -min(by_power, by_current, by_voltage), True

    def _warm(self, dt: float, current: float, resistance: float) -> None:
        """Heat, and the RC pair: both are linear, so both are stepped exactly for a constant current."""
        heat = current * current * resistance
        if self.design.relaxation:
            r1 = resistance / 2.0
            heat += self._v1 * self._v1 / r1
            settled = current * r1
            self._v1 = settled + (self._v1 - settled) * math.exp(-dt / RELAXATION_TIME)
        settled = self._ambient + heat * THERMAL_RESISTANCE
        decay = math.exp(-dt / (HEAT_CAPACITY * THERMAL_RESISTANCE))
        self._temperature = settled + (self._temperature - settled) * decay

    def _report(self, current: float, supplied: bool, charging: bool) -> PackState:
        resistance = self.design.resistance(self._temperature)
        capacity = self.design.capacity(self._temperature)
        return PackState(
            voltage=self.design.open_voltage(self._soc) - self._v1 - current * resistance,
            current=-current if current else 0.0,
            charge=self._soc * capacity,
            capacity=capacity,
            temperature=self._temperature,
            soc=self._soc,
            status=self._status(current, charging),
            supplied=supplied,
            cells=self.design.series_cells,
        )

    def _status(self, current: float, charging: bool) -> SupplyStatus:
        if current > 0.0:
            return SupplyStatus.DISCHARGING
        if current < 0.0:
            return SupplyStatus.CHARGING
        return SupplyStatus.FULL if charging and self._full else SupplyStatus.NOT_CHARGING
