"""How wrong the sensors are: one value for all of them, which a simulated body takes. Units are SI, angles rad.

`Sensors.ideal()` are those of a laboratory: white noise, and nothing else. `Sensors.real()` are those of a robot in use: a LiDAR that turns
while the body walks and tilts, an IMU with scale and misalignment, encoders with zero offsets, contacts that come late.

What is called ``_sd`` is drawn once for each robot, from its seed; the rest is the same for all. Where the numbers are from:
docs/concepts/control.md#sensor-models.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import radians
from typing import Literal, TypeAlias

SensorKind: TypeAlias = Literal["ideal", "real"]


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """What an IMU has besides white noise and a bias that walks."""

    gyro_step: float = 0.0
    """Standard deviation of a sudden change of each gyro bias, rad/s: warming up, a knock."""
    accel_step: float = 0.0
    """The same of each accelerometer bias, m/s2."""
    step_every: float = 60.0
    """Mean time between two such steps, s."""
    scale_sd: float = 0.0
    """Of each axis' scale, relative."""
    misalignment_sd: float = 0.0
    """Angle by which each axis leans towards each other one."""

    def __post_init__(self) -> None:
        if not self.step_every > 0.0:
            raise ValueError(f"bias steps every {self.step_every!r} s: give a mean time above 0")


@dataclass(frozen=True, slots=True)
class EncoderErrors:
    """What joint encoders have wrong."""

    position: float = 5e-4
    """Standard deviation of one reading, rad."""
    velocity: float = 0.05
    """The same of a speed, rad/s."""
    zero_sd: float = 0.0
    """Of each joint's zero, as it was found when the leg was mounted."""
    effort: float = 0.0
    """Standard deviation of one torque, N m."""


@dataclass(frozen=True, slots=True)
class ContactErrors:
    """What foot contacts have wrong. Raises `ValueError` for what cannot be."""

    delay: float = 0.0
    """By which they come late, s."""
    dropout: float = 0.0
    """Share of the samples in which a standing foot is not felt."""

    def __post_init__(self) -> None:
        if self.delay < 0.0 or not 0.0 <= self.dropout <= 1.0:
            raise ValueError(
                f"Contact errors got delay {self.delay!r} s and dropout {self.dropout!r}: "
                "give a delay of at least 0 and a dropout from 0 to 1."
            )


@dataclass(frozen=True, slots=True)
class LidarErrors:
    """What a LiDAR has wrong. Raises `ValueError` for what cannot be."""

    noise: float = 0.015
    """Standard deviation of one range, m."""
    bias: float = 0.0
    """Every range is too long by the same length, which lies anywhere from minus to plus this, m."""
    dropout: float = 0.0
    """Share of the beams that come back without a return."""
    sweep: float = 0.0
    """Time of one revolution, s. With 0 all beams look at one instant, from a gimbal that keeps them level; else the LiDAR is fixed to the
    body, tilts with it, and sees the floor and the robot's own legs."""
    misalignment_sd: float = 0.0
    """Of the mount's roll, pitch and yaw, against where they are thought to be."""

    def __post_init__(self) -> None:
        if min(self.noise, self.bias, self.sweep) < 0.0 or not 0.0 <= self.dropout < 1.0:
            raise ValueError(
                f"{self!r} cannot be: give lengths and times of at least 0, and a dropout from 0 to below 1"
            )


@dataclass(frozen=True, slots=True)
class Sensors:
    """The errors of all sensors of a robot."""

    imu: ImuErrors = field(default_factory=ImuErrors)
    encoders: EncoderErrors = field(default_factory=EncoderErrors)
    contacts: ContactErrors = field(default_factory=ContactErrors)
    lidar: LidarErrors = field(default_factory=LidarErrors)

    @classmethod
    def ideal(cls) -> Sensors:
        """White noise and walking biases only."""
        return cls()

    @classmethod
    def real(cls) -> Sensors:
        """Those of a robot in use."""
        return cls(
            imu=ImuErrors(gyro_step=5e-4, accel_step=0.05, scale_sd=2e-3, misalignment_sd=radians(0.2)),
            encoders=EncoderErrors(zero_sd=radians(0.3), effort=0.5),
            contacts=ContactErrors(delay=0.01, dropout=0.01),
            lidar=LidarErrors(bias=0.03, dropout=0.15, sweep=0.1, misalignment_sd=radians(0.2)),
        )

    @classmethod
    def of(cls, kind: SensorKind) -> Sensors:
        """`ideal` or `real`, by name."""
        return cls.real() if kind == "real" else cls.ideal()
