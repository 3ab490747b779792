"""The figures of the joint drives: how fast, how strong, how long (docs/concepts/control.md#actuators)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from robot.model.parameters import KNEE_TORQUE
from robot.model.power import COPPER_LOSS, copper_loss
from robot.model.robot import RobotModel

NOMINAL_VOLTAGE = 51.8
"""Of the drives' bus, V: 14 cells of 3.7 V."""
MOTOR_DELAY = 0.004
"""How late the drives act on targets, s."""
KNEE = max(torque for _, torque in KNEE_TORQUE)
"""Of the reference body, N m."""
SILENCE = 0.05
"""Seconds without targets after which the drives act by themselves: 10 periods of the control loop."""


@dataclass(frozen=True, slots=True)
class ActuatorDesign:
    """Twelve electric drives on one bus. Raises `ValueError` for figures that no drive has.

    The torque that a drive can give falls linearly with speed, from `stall` times its limit at rest to nothing at its no-load speed; its
    limit cuts that line off. The knee's drive pulls by a lever that changes with the knee's angle: where it is strong it is slow.
    """

    no_load: float = 24.0
    """Of hip and shoulder at the nominal voltage, rad/s."""
    knee_product: float = 2264.0
    """Torque limit times no-load speed of the knee, W: the same at every angle, as force and speed of its drive are. 20 rad/s at 113.2 N m."""
    stall: float = 2.0
    """So many times the limit is what the line begins with: up to 1 - 1/stall of the no-load speed the whole limit is there."""
    bus_current: float = 60.0
    """What all drives together may draw, A: 3.1 kW at the nominal voltage."""
    winding_capacity: float = 100.0
    """Heat capacity of one winding, J/K."""
    winding_resistance: float = 0.5
    """From the winding to its housing, K/W."""
    housing_capacity: float = 800.0
    """Of one housing, J/K."""
    housing_resistance: float = 0.7
    """From the housing to the air, K/W."""
    copper_loss: float = COPPER_LOSS
    """What a winding turns into heat, W/(N m)^2."""
    derate_from: float = 100.0
    """Winding temperature from which the limit is taken back, C."""
    derate_to: float = 130.0
    """Winding temperature at which nothing is left of it, C."""
    ambient: float = 25.0
    """Of the air, and of the drives at first, C."""

    @classmethod
    def of(cls, model: RobotModel) -> ActuatorDesign:
        """These drives for another robot: as fast as its legs need at the same Froude number, and as strong for its weight."""
        own, power = cls(), model.force * model.speed
        strongest = max(torque for _, torque in model.knee_torque)
        return replace(
            own,
            no_load=own.no_load / model.speed,
            knee_product=own.knee_product / KNEE * strongest / model.speed,
            bus_current=own.bus_current * power,
            copper_loss=copper_loss(model),
            winding_capacity=own.winding_capacity * model.force,
            winding_resistance=own.winding_resistance / model.force,
            housing_capacity=own.housing_capacity * model.force,
            housing_resistance=own.housing_resistance / model.force,
        )

    def __post_init__(self) -> None:
        positive = (
            self.no_load, self.knee_product, self.bus_current, self.winding_capacity, self.winding_resistance,
            self.housing_capacity, self.housing_resistance,
        )  # fmt: skip
        if not (all(math.isfinite(one) and one > 0.0 for one in positive) and self.stall >= 1.0):
            raise ValueError(f"{self!r}: every figure of a drive is positive, and its stall torque at least its limit.")
        if not self.ambient < self.derate_from < self.derate_to:
            raise ValueError(f"{self!r}: a drive is derated between two temperatures above that of the air.")
