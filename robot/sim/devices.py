"""The devices of a simulated robot: what its nodes take in place of a real one's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from actors.time.lockstep import Simulated
from robot.geometry.planar import Pose2, placed
from robot.geometry.vectors import Floats, rotation_of
from robot.hardware import mounts
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.hardware.body import NO_REPLAY, Sweep
from robot.hardware.depth import PATTERNS
from robot.hardware.devices import BatteryDevice, Equipment, Frame
from robot.sim.camera_columns import Eye
from robot.sim.camera_view import View
from robot.sim.depth_noise import LATENCY, DepthNoise, look, seen
from robot.sim.simulation import Simulation

if TYPE_CHECKING:
    import asyncio

    from robot.hardware.arm import ArmState, GripperState
    from robot.scenes.scene import Scene


class _Part(Simulated):
    """Something that is part of a simulated body: its instants are the body's, and so is its reader's clock."""

    no_replay: Final = NO_REPLAY

    def __init__(self, body: Simulation) -> None:
        self._body = body

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._body!r})"

    def advance(self, until: float) -> None:
        self._body.advance(until)

    def keep_step(self, loop: asyncio.AbstractEventLoop) -> None:
        if isinstance(self._body, Simulated) and not self._body.real_time:
            self._body.keep_step(loop)


class SimulatedCharger(_Part):
    """The contacts of the scene's dock."""

    @property
    def connected(self) -> bool:
        return self._body.charger


class SimulatedLidar(_Part):
    """A LiDAR in a gimbal, or one that is fixed to the body and turns, if its errors have a `sweep`."""

    @property
    def fixed(self) -> bool:
        return self._body.sensors.lidar.sweep != 0.0

    @property
    def bias(self) -> float:
        return self._body.sensors.lidar.bias

    def scan(self) -> Sweep | None:
        """Of a LiDAR in a gimbal the ranges of this instant."""
        if self.fixed:
            return self._body.sweep()
        return Sweep(self._body.time, 0.0, self._body.lidar(BEAMS, MAX_RANGE))


class SimulatedCamera(_Part):
    """On a gimbal that follows the body's place and heading and stays level. It renders the true world."""

    def __init__(self, body: Simulation) -> None:
        super().__init__(body)
        self._mount = mounts.camera_of(body.model)
        self._scene: Scene | None = None
        """What the view shows; it is made where the camera is used, which may be another process."""

    def look(self) -> Frame:
        """The picture of this instant."""
        if self._body.scene is not self._scene:  # the first picture, or its obstacles have changed
            self._scene, self._view = self._body.scene, View(self._body.scene)
        return self._view.look(self._eye(), self._body.things())

    def _eye(self) -> Eye:
        truth = self._body.truth()
        x, y, z = truth.position.tolist()
        ahead, left, up = self._mount.translation
        return Eye(*placed(Pose2(x, y, truth.yaw), ahead, left), z + up, truth.yaw)


class SimulatedDepth(_Part):
    """The depth cameras, with noise of a `seed`, pixels without depth, and pictures that never come."""

    latency = LATENCY

    def __init__(self, body: Simulation, seed: int) -> None:
        super().__init__(body)
        self._noise = DepthNoise(np.random.default_rng((seed, 0)))
        self._taken = 0

    def points(self) -> Floats | None:
        """The picture of this instant."""
        truth, scene = self._body.truth(), self._body.scene
        pattern = self._taken % PATTERNS
        self._taken += 1
        rotation = rotation_of(truth.quaternion)
        exact = look(self._body.obstacles(), scene.pits, truth.position, rotation, pattern, scene.terrain)
        depths = self._noise.apply(exact)
        return None if depths is None else seen(depths, pattern)


class SimulatedArm(_Part):
    """The arm of a body, which must have one; implements `ArmDevice`."""

    def __init__(self, body: Simulation) -> None:
        super().__init__(body)
        if body.arm is None:
            raise ValueError(f"{body!r} has no arm to drive: make the body with arm=True")
        self._arm = body.arm

    def move(self, target: Sequence[float]) -> float:
        """Begin a motion."""
        return self._arm.move(target)

    def stop(self) -> float:
        """Brake within limits."""
        return self._arm.stop()

    def state(self) -> ArmState:
        return self._arm.state()

    def grip(self, closing: bool) -> None:
        """Close or open the gripper."""
        self._arm.grip(closing)

    @property
    def gripper(self) -> GripperState:
        return self._arm.gripper


def simulated(body: Simulation, battery: BatteryDevice, *, sight: bool = False, seed: int = 0) -> Equipment:
    """Everything that a simulated robot has; with `sight` also depth cameras, whose noise is of the `seed`."""
    return Equipment(
        body,
        battery,
        charger=SimulatedCharger(body),
        lidar=SimulatedLidar(body),
        camera=SimulatedCamera(body),
        depth=SimulatedDepth(body, seed) if sight else None,
        arm=SimulatedArm(body) if body.arm is not None else None,
        model=body.model,
    )
