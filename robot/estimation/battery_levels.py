"""What the charge means for the robot: good, low or critical, without chatter at the borders."""

from __future__ import annotations

from robot.hardware.battery import PackState
from robot.model.battery import EMPTY_VOLTAGE
from robot.model.charge import CRITICAL, HYSTERESIS, LOW, ChargeLevel

EMPTY_TIME = 2.0


class LevelMonitor:
    """Follows the coulomb count (30 % and 10 %) and the voltage (10.0 V per three cells for 2 s).

    A worse level is taken at once; a better one only when the charge is 3 points above the border. A level that the
    voltage made critical is left only after 3 points have been charged since: a voltage that recovers once the
    motors are off proves nothing, and walking on would bring it down again.
    """

    __slots__ = ("_leave_at", "_under", "level")

    def __init__(self, kept: tuple[ChargeLevel, float] = (ChargeLevel.GOOD, 0.0)) -> None:
        self.level, self._leave_at = kept
        self._under = 0.0

    @property
    def kept(self) -> tuple[ChargeLevel, float]:
        """What a new monitor of the same pack must know to go on where this one ended: hysteresis has a memory."""
        return self.level, self._leave_at

    def update(self, dt: float, state: PackState) -> ChargeLevel:
        """Judge the pack's `state` at the end of `dt` seconds; returns the level, also kept in `level`."""
        self._under = self._under + dt if state.gauge_voltage < EMPTY_VOLTAGE else 0.0
        if state.soc < CRITICAL or self._under >= EMPTY_TIME:
            if self.level is not ChargeLevel.CRITICAL:
                self._leave_at = max(CRITICAL, state.soc) + HYSTERESIS
            self.level = ChargeLevel.CRITICAL
        elif self.level is ChargeLevel.CRITICAL and state.soc < self._leave_at:
            pass
        elif state.soc < LOW or (self.level is not ChargeLevel.GOOD and state.soc < LOW + HYSTERESIS):
            self.level = ChargeLevel.LOW
        else:
            self.level = ChargeLevel.GOOD
        return self.level
