"""A robot as its controllers meet it: drives that take commands, and sensors that can be read. A driver of a real robot implements `Hardware`.

What else a robot has, such as a LiDAR or an arm, are devices of their own (`robot.hardware.devices`). The simulated robots implement `Hardware` too
(`robot.sim.simulation`), and nodes cannot tell the difference.

Joint order everywhere: fl, fr, rl, rr; in each leg hip, shoulder, knee (12 joints). Units are SI, angles rad, quaternions (w, x, y, z).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Vector
from robot.model.power import motor_power

NO_REPLAY = "is the robot's hardware, which its nodes read and drive by calls that no journal carries: record the nodes that hear of it by topics instead"
"""Why no journal is kept of a node that holds hardware."""

LEGS = ("fl", "fr", "rl", "rr")
JOINT_NAMES = tuple(f"{leg}_{joint}" for leg in LEGS for joint in ("hip", "shoulder", "knee"))


@dataclass(frozen=True, slots=True)
class MotorTargets:
    """The command of the motor drives of all 12 joints: torque = effort + kp (position - q) + kd (velocity - qd), then limited.

    Every field has shape (12,). The drives close this loop themselves, faster than targets come; the motor delay lies on the targets.
    """

    position: Vector
    velocity: Vector
    effort: Vector
    kp: Vector
    kd: Vector


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Angular velocity (rad/s) and specific force (m/s2) in body axes, with noise (docs/concepts/control.md#sensor-models); shape (3,) each."""

    gyro: Vector
    accel: Vector


@dataclass(frozen=True, slots=True)
class JointSample:
    """Encoder positions (rad), speeds (rad/s) and motor torques (N m), shape (12,), and foot contact (force > 5 N), shape (4,) bool."""

    position: Vector
    velocity: Vector
    effort: Vector
    contact: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Sample:
    """What IMU and encoders measured at one instant."""

    time: float
    """Of the measurement, s, on the clock of `Hardware.time`."""
    imu: ImuSample
    joints: JointSample


@dataclass(frozen=True, slots=True)
class Sweep:
    """One revolution of a LiDAR that turns. Beam i of n looked along -pi + i 2 pi / n in the sensor's axes, at ``start + i sweep / n``."""

    start: float
    """Of the first beam, s, on the clock of `Hardware.time`."""
    sweep: float
    """How long it took, s; 0 of beams that are taken all at once."""
    ranges: Vector
    """m, shape (n,); `MAX_RANGE` means no return."""


@dataclass(frozen=True, slots=True)
class ActuatorState:
    """What the motor drives tell of themselves."""

    supplied: bool
    """Whether the battery gives them current."""
    temperature: Vector
    """Of each motor's winding, C, shape (12,); empty where drives do not get warm."""
    left: float
    """Share of its torque that heat leaves to the hottest drive: 1 is all."""


class BodySilent(RuntimeError):
    """The robot is not heard any more: its connection is lost, or the process of a simulated one has ended or stands still."""


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a robot can and cannot do; nodes ask before they rely on it."""

    steps: bool = False
    """It walks by itself: it takes velocities (`SteppingHardware`), and no motor targets."""
    contacts: bool = True
    """It feels its feet on the ground. One that does not walks by schedule."""


class Hardware(Protocol):
    """The legs of one robot: 12 drives, an IMU, encoders and foot contacts. Nodes and controllers know no more of a robot than this.

    A driver inherits from it and writes `time`, `command`, `sample`, `next_sample`, `imu` and `joints`; the rest has defaults that are right for
    most robots. All is called from one thread, an event loop's: nothing may block. What reads raises `BodySilent` when the robot is not heard.
    """

    @property
    def time(self) -> float:
        """Seconds, on the clock of the caller of `advance`."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it can do. By default it takes motor targets and feels its feet."""
        return Capabilities()

    def advance(self, until: float) -> None:
        """Take in what has happened up to `until`, the caller's present, s. It is called before all else; by default nothing is to be done."""
        return

    def command(self, targets: MotorTargets) -> None:
        """Give the motor drives new targets at the present instant; they take effect after the motor delay."""
        ...

    def supply(self, voltage: float) -> None:
        """The battery gives the drives this share of its nominal voltage from now on; 0 cuts them off: they brake, and follow no command.

        By default nothing: real drives feel their battery by themselves.
        """
        return

    def actuators(self) -> ActuatorState:
        """What the drives report of themselves at the present instant; by default that they have current and do not get warm."""
        return ActuatorState(supplied=True, temperature=np.empty(0), left=1.0)

    def sample(self, hz: float) -> None:
        """From the present instant on, sample IMU and encoders `hz` times a second; samples that wait are forgotten."""
        ...

    def next_sample(self) -> Sample | None:
        """The oldest sample that nobody has taken, of those up to the present instant; at most the newest 40 wait."""
        ...

    def imu(self) -> ImuSample:
        """The newest measurement."""
        ...

    def joints(self) -> JointSample:
        """The newest measurement."""
        ...

    @property
    def power(self) -> float:
        """What the motors take now, W, without what is always on. By default computed from torques and speeds (docs/concepts/control.md#power-and-battery)."""
        joints = self.joints()
        return motor_power(joints.effort, joints.velocity)


@runtime_checkable
class SteppingHardware(Protocol):
    """What hardware with `Capabilities.steps` has besides: it does its legs by itself, and takes a velocity instead of motor targets."""

    def drive(self, vx: float, vy: float, wz: float, height: float, mode: str) -> None:
        """Walk at (vx, vy) m/s forward and left, turning wz rad/s, with the hips `height` m above the foot centres; valid for 0.1 s.

        Raises `ValueError` for an unknown mode or a height that is not a number.
        """
        ...
