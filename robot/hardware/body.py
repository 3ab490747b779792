"""The robot's body as its controllers meet it: motors that take commands, sensors that can be read, and the truth for judges.

Two back ends serve this one interface: ``physics`` (MuJoCo: contacts, falls, torque limits, motor delay) and ``kinematic``
(numpy only: it cannot fall, so it may never be reported as walking performance). Both are advanced on demand: whoever reads or
commands first says which instant it is, and the body integrates up to there, so several nodes share one body without a rate of its own.

Joint order everywhere: fl, fr, rl, rr; in each leg hip, shoulder, knee (12 joints). Units are SI, angles rad, quaternions (w, x, y, z).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Vector
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.hardware.sensors import Sensors
from robot.scenes.scene import Obstacle, Scene, Thing

if TYPE_CHECKING:
    from robot.hardware.arm import ArmDevice

__all__ = [
    "JOINT_NAMES",
    "LEGS",
    "NO_REPLAY",
    "ActuatorState",
    "Body",
    "BodySilent",
    "ImuSample",
    "JointSample",
    "MotorTargets",
    "Sample",
    "SteppingBody",
    "Sweep",
    "Truth",
]

NO_REPLAY = "is the robot's body, which its nodes read and drive by calls that no journal carries: replay the nodes that hear of it by topics"
"""Why no journal is kept of a node that holds a body."""

LEGS = ("fl", "fr", "rl", "rr")
JOINT_NAMES = tuple(f"{leg}_{joint}" for leg in LEGS for joint in ("hip", "shoulder", "knee"))


@dataclass(frozen=True, slots=True)
class MotorTargets:
    """What the motor drives of all 12 joints are told: torque = effort + kp (position - q) + kd (velocity - qd), then limited.

    Every field has shape (12,). The drives close this loop themselves at the back end's step; the motor delay lies on the targets.
    """

    position: Vector
    velocity: Vector
    effort: Vector
    kp: Vector
    kd: Vector


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Angular velocity (rad/s) and specific force (m/s2) in body axes, with noise (docs/control.md#sensor-models); shape (3,) each."""

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
    """Simulated seconds."""
    imu: ImuSample
    joints: JointSample


@dataclass(frozen=True, slots=True)
class Sweep:
    """One revolution of a LiDAR that turns. Beam i of n looked along -pi + i 2 pi / n in the sensor's axes, at ``start + i sweep / n``."""

    start: float
    """Simulated seconds."""
    sweep: float
    """How long it took, s."""
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


@dataclass(frozen=True, slots=True)
class Truth:
    """The true state, for judges and pictures only: no controller may read it."""

    position: Vector
    """Body frame origin in the world, shape (3,), metres."""
    quaternion: Vector
    """Attitude, body to world, shape (4,), w first."""
    velocity: Vector
    """Linear velocity in world axes, shape (3,), m/s."""
    angular_velocity: Vector
    """In body axes, shape (3,), rad/s."""
    joints: Vector
    """Joint positions, shape (12,), rad."""
    fallen: bool
    """Body z axis more than 60 degrees from vertical, or body less than 0.15 m above its lowest foot."""
    lying: bool
    """Trunk or thigh rests on the floor: of a robot that sits nothing but that, of one that stands or walks a fall."""
    touching: tuple[str, ...]
    """Names of scene obstacles (``box_0``, ``cylinder_3`` in scene order) that any part of the robot touches now."""
    power: float
    """Electrical motor power now: sum(max(tau qd, 0)) + k_cu sum(tau^2), W, without hotel load (docs/control.md#power-and-battery)."""

    @property
    def yaw(self) -> float:
        """Of the attitude, rad."""
        w, x, y, z = self.quaternion.tolist()
        return yaw_of(w, x, y, z)


class BodySilent(RuntimeError):
    """The body's process has ended, or stands still. Only a body in a process of its own raises it, from whatever reads or asks."""


class Body(Protocol):
    """One simulated robot in one scene."""

    @property
    def backend(self) -> str:
        """``physics`` or ``kinematic``; every report names it."""
        ...

    @property
    def scene(self) -> Scene: ...

    @property
    def sensors(self) -> Sensors:
        """How wrong its sensors are."""
        ...

    @property
    def time(self) -> float:
        """Simulated seconds since construction."""
        ...

    @property
    def arm(self) -> ArmDevice | None:
        """The arm, if it has one."""
        ...

    @property
    def charger(self) -> bool:
        """Whether the charger's contacts are closed."""
        ...

    def things(self) -> tuple[Thing, ...]:
        """The scene's things where they are now, for cameras and judges; without an arm they stay where the scene has them."""
        ...

    def obstacles(self) -> tuple[Obstacle, ...]:
        """What stands, hangs or walks in the scene, where it is now: for depth cameras and judges."""
        ...

    def advance(self, until: float) -> None:
        """Integrate up to `until` (simulated seconds). Never goes back; a body with no command for 100 ms damps its joints."""
        ...

    def command(self, targets: MotorTargets) -> None:
        """Give the motor drives new targets at the present instant; they take effect after the motor delay."""
        ...

    def supply(self, voltage: float) -> None:
        """The battery gives the drives this share of its nominal voltage from now on; 0 cuts them off: they brake, and follow no command."""
        ...

    def actuators(self) -> ActuatorState:
        """What the drives tell of themselves at the present instant."""
        ...

    def sample(self, hz: float) -> None:
        """From the body's present instant on, sample IMU and encoders `hz` times a second of its time; samples that wait are forgotten."""
        ...

    def next_sample(self) -> Sample | None:
        """The oldest sample that nobody has taken, of those the body has reached; at most the newest 40 wait."""
        ...

    def imu(self) -> ImuSample: ...

    def joints(self) -> JointSample: ...

    def lidar(self, beams: int = BEAMS, max_range: float = MAX_RANGE) -> Vector:
        """Ranges (m) from the body origin, beam i at angle -pi + i 2 pi / beams in the body's yaw frame; `max_range` means no return."""
        ...

    def sweep(self) -> Sweep | None:
        """The newest whole revolution of a LiDAR that turns, which the first call sets going; `None` before its end, and of one that does not."""
        ...

    def truth(self) -> Truth: ...

    @property
    def power(self) -> float:
        """That of the motors alone, as `truth` has it: it is asked for 200 times a second, and the rest takes ten times as long."""
        ...

    def push(self, impulse: tuple[float, float, float], duration: float = 0.1) -> None:
        """Push the body with a constant force for `duration` seconds; `impulse` is the total, N s in world axes."""
        ...

    def place(self, pose: Pose2) -> None:
        """Put the robot down, lying in its sitting pose at rest, at `pose`."""
        ...

    def close(self) -> None:
        """Free what the back end holds."""
        ...


@runtime_checkable
class SteppingBody(Protocol):
    """What a body has besides that does its legs by itself: it takes a velocity instead of motor targets."""

    def drive(self, vx: float, vy: float, wz: float, height: float, mode: str) -> None:
        """Walk at (vx, vy) m/s forward and left, turning wz rad/s, with the hips `height` m above the foot centres; valid for 0.1 s.

        Raises `ValueError` for an unknown mode or a height that is not a number.
        """
        ...
