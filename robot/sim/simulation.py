"""The simulated robot: hardware that is controlled as a real one is, and besides known to the last detail by judges, tests and pictures.

Two back ends serve this one interface: ``physics`` (MuJoCo: contacts, falls, torque limits, motor delay) and ``kinematic``
(numpy only: it cannot fall, so it may never be reported as walking performance). Both are advanced on demand: code that reads or
commands first says which instant it is, and the body integrates up to there, so several nodes share one body without a rate of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmDevice
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.hardware.body import Hardware, Sweep
from robot.hardware.sensors import Sensors
from robot.model.robot import RobotModel
from robot.scenes.scene import Obstacle, Scene, Thing


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
    """Electrical motor power now: sum(max(tau qd, 0)) + k_cu sum(tau^2), W, without hotel load (docs/concepts/control.md#power-and-battery)."""

    @property
    def yaw(self) -> float:
        """Of the attitude, rad."""
        w, x, y, z = self.quaternion.tolist()
        return yaw_of(w, x, y, z)


class SimulationArm(ArmDevice, Protocol):
    """An arm that is known to the last detail, too."""

    @property
    def held(self) -> str | None:
        """The name of the thing in the gripper."""
        ...


class Simulation(Hardware, Protocol):
    """One simulated robot in one scene. No node and no controller knows more of it than `Hardware` has."""

    @property
    def backend(self) -> str:
        """``physics`` or ``kinematic``; every report names it."""
        ...

    @property
    def scene(self) -> Scene: ...

    @property
    def model(self) -> RobotModel:
        """The figures that it has."""
        ...

    @property
    def sensors(self) -> Sensors:
        """How wrong its sensors are."""
        ...

    @property
    def arm(self) -> SimulationArm | None:
        """The arm, if it has one."""
        ...

    @property
    def charger(self) -> bool:
        """Whether the charger's contacts are closed."""
        ...

    def things(self) -> tuple[Thing, ...]:
        """The scene's things where they are now; without an arm they stay where the scene has them."""
        ...

    def obstacles(self) -> tuple[Obstacle, ...]:
        """What stands, hangs or walks in the scene, where it is now."""
        ...

    def lidar(self, beams: int = BEAMS, max_range: float = MAX_RANGE) -> Vector:
        """Ranges (m) from the body origin, beam i at angle -pi + i 2 pi / beams in the body's yaw frame; `max_range` means no return."""
        ...

    def sweep(self) -> Sweep | None:
        """The newest whole revolution of a LiDAR that turns, which the first call sets going; `None` before its end, and of one that does not."""
        ...

    def truth(self) -> Truth: ...

    def push(self, impulse: tuple[float, float, float], duration: float = 0.1) -> None:
        """Push the body with a constant force for `duration` seconds; `impulse` is the total, N s in world axes."""
        ...

    def place(self, pose: Pose2) -> None:
        """Put the robot down, lying in its sitting pose at rest, at `pose`."""
        ...

    def close(self) -> None:
        """Free what the back end holds."""
        ...
