"""Whether the energy for a walk is there: for the way to the goal, and from there to the dock (docs/concepts/control.md#power-and-battery)."""

from __future__ import annotations

from robot.model.charge import HYSTERESIS, RESERVE
from robot.model.power import HOUR, electrical_power, typical_motor_power
from robot.model.robot import SPOT, RobotModel

MARGIN = 1.5
"""On the typical energy of a walk: for turns, detours and waiting for what is in the way."""
OVERHEAD = 2.0
"""Wh that the reference body takes for standing up, docking and sitting down: half a minute of it."""
AT_DOCK = 1.5
"""A goal so near to the dock, m, is the way home."""

FULL = 100.0
"""Per cent."""


def walking_energy(metres: float, speed: float, model: RobotModel = SPOT) -> float:
    """What the battery typically gives for a walk of so many metres at `speed` m/s, Wh."""
    power = electrical_power(typical_motor_power(speed, 0.0, 0.0, walking=True, model=model), model=model)
    return power * metres / speed / HOUR


class EnergyGuard:
    """Follows what the battery says, and judges walks by it. Without a word from a battery, every walk is possible."""

    __slots__ = ("_energy", "_home_only", "_model", "_percent", "_speed")

    def __init__(self, speed: float, model: RobotModel = SPOT) -> None:
        self._speed, self._model = speed, model
        self._percent = FULL
        self._energy: float | None = None
        self._home_only = False

    def set_speed(self, speed: float) -> None:
        """Reckon with walks at another speed, m/s, from now on."""
        self._speed = speed

    def heard(self, percent: float, energy: float) -> None:
        """The charge, and the energy in Wh that is left before it is critical."""
        self._percent, self._energy = percent, energy
        share = percent / FULL
        self._home_only = share < RESERVE or (self._home_only and share < RESERVE + HYSTERESIS)

    def objection(self, ahead: float, home: float) -> str:
        """Why a walk of `ahead` metres must not be made or gone on with, when the dock is `home` metres from its goal; or nothing.

        The way to the dock is always open.
        """
        if self._energy is None or home <= AT_DOCK:
            return ""
        if self._home_only:
            return f"battery critical for new goals ({self._percent:.0f} %): only the way to the dock is open"
        need = MARGIN * walking_energy(ahead + home, self._speed, self._model) + OVERHEAD * self._model.force
        if need > self._energy:
            return (
                f"battery too low: {ahead:.0f} m to the goal and {home:.0f} m back to the dock need {need:.1f} Wh, "
                f"and {max(self._energy, 0.0):.1f} Wh are left before it is critical"
            )
        return ""
