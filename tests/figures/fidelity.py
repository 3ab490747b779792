"""Whether a figure is taken with the sensors and drives of a laboratory, or with those of a robot in use."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import dataclass
from typing import Any

from robot.hardware.sensors import SensorKind, Sensors
from robot.model.actuators import ActuatorDesign
from robot.model.robot import SPOT, RobotModel
from robot.testing import Conditions


@dataclass(frozen=True, slots=True)
class Fidelity:
    """How true to a robot in use a simulated one is."""

    sensors: SensorKind = "real"
    actuators: SensorKind = "real"

    @classmethod
    def of(cls, asked: Namespace) -> Fidelity:
        """What a command line with the words of `add_fidelity` says. A kinematic body has no drives that could be as they are."""
        kinematic = getattr(asked, "backend", "physics") == "kinematic"
        return cls(asked.sensors, "ideal" if kinematic else asked.actuators)

    @property
    def errors(self) -> Sensors:
        """Of the sensors."""
        return Sensors.of(self.sensors)

    @property
    def drives(self) -> ActuatorDesign | None:
        """The drives' figures; None: each always has its torque limit."""
        return ActuatorDesign() if self.actuators == "real" else None

    @property
    def told(self) -> dict[str, str]:
        """For JSON."""
        return {"sensors": self.sensors, "actuators": self.actuators}

    def __str__(self) -> str:
        return f"sensors {self.sensors}, actuators {self.actuators}"

    def conditions(self, delay: float, model: RobotModel = SPOT, **more: Any) -> Conditions:
        """Those of a trial of this robot with a motor delay in s; `more` are further fields of `Conditions`."""
        drives = ActuatorDesign.of(model) if self.actuators == "real" else None
        return Conditions(delay=delay, sensors=self.errors, actuators=drives, **more)


IDEAL = Fidelity("ideal", "ideal")
"""White noise in the sensors, and drives that always have their torque limit."""


def add_sensors(parser: ArgumentParser) -> None:
    """Add --sensors, real unless told otherwise."""
    parser.add_argument(
        "--sensors", choices=("ideal", "real"), default="real", help="of LiDAR, IMU and legs; ideal: white noise (default real)"
    )  # fmt: skip


def add_fidelity(parser: ArgumentParser) -> None:
    """Add --sensors and --actuators, both real unless told otherwise."""
    add_sensors(parser)
    parser.add_argument(
        "--actuators", choices=("ideal", "real"), default="real",
        help="drives with torque curve, bus and heat; ideal: always their torque limit (default real)",
    )  # fmt: skip
