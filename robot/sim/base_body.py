"""What the simulated bodies share: the clock, the samples and their noise, the scene and its things."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Protocol

import numpy as np

from actors.time.lockstep import Lockstep, Simulated
from robot.geometry.vectors import Floats, Vector
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.hardware.body import NO_REPLAY, ActuatorState, Capabilities, ImuSample, JointSample, Sample, Sweep
from robot.hardware.sensors import Sensors
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Obstacle, Scene, Thing
from robot.sim.charger import charger_connected
from robot.sim.noise import ContactNoise, EncoderNoise, ImuNoise, LidarNoise
from robot.sim.sampling import ROUNDING, Sampling
from robot.sim.simulation import SimulationArm, Truth
from robot.sim.spin import Spin

if TYPE_CHECKING:
    import asyncio

TICK = 0.0005
"""Every instant of a body is a whole number of these, s: readers that come a little apart do not chop the simulation up."""
LOST_COMMAND_TICKS = 200
"""Ticks without a command (0.1 s) after which a body is on its own."""


class SimulatedArm(SimulationArm, Protocol):
    """An arm that also knows where the scene's things are."""

    def things(self) -> tuple[Thing, ...]: ...


class BaseBody(Simulated):
    """The part of a body that is the same whatever moves it: an heir integrates its motion and tells exact measurements.

    Its time is a whole number of ticks and never goes back. At one instant every reader gets the same sample of IMU and of joints: noise is
    drawn once. Without `noise` measurements are exact, but a LiDAR that turns turns all the same.
    """

    no_replay = NO_REPLAY

    def __init__(
        self, scene: Scene, *, seed: int, noise: bool, sensors: Sensors | None = None, model: RobotModel = SPOT
    ) -> None:
        self._scene, self._noise, self._figures = scene, noise, model
        self._sensors = sensors or Sensors.ideal()
        self._imu_noise = ImuNoise(seed, errors=self._sensors.imu)
        self._encoder_noise = EncoderNoise(seed, self._sensors.encoders)
        self._contact_noise = ContactNoise(seed, errors=self._sensors.contacts)
        self._lidar_noise = LidarNoise(seed, self._sensors.lidar)
        turning = self._sensors.lidar.sweep
        self._spin = Spin(turning, self._look) if turning > 0.0 else None
        self._imu_read: tuple[int, ImuSample] | None = None
        self._joints_read: tuple[int, JointSample] | None = None
        self._ticks: int = 0
        self._supplied = True
        self._sampling = Sampling(self._integrate, self._sample)

    @property
    def scene(self) -> Scene:
        return self._scene

    @property
    def model(self) -> RobotModel:
        """The robot whose figures it has."""
        return self._figures

    @property
    def sensors(self) -> Sensors:
        return self._sensors

    @property
    def time(self) -> float:
        return self._ticks * TICK

    @property
    def capabilities(self) -> Capabilities:
        """Drives that take motor targets, and feet that feel the ground."""
        return Capabilities()

    @property
    @abstractmethod
    def arm(self) -> SimulatedArm | None: ...

    @property
    def charger(self) -> bool:
        """Whether the robot sits on its dock."""
        return charger_connected(self.truth(), self._scene.dock)

    def things(self) -> tuple[Thing, ...]:
        """The scene's things, where they are now."""
        return self.arm.things() if self.arm is not None else self._scene.things

    def obstacles(self) -> tuple[Obstacle, ...]:
        """The scene's obstacles: nothing moves them."""
        return self._scene.obstacles

    def keep_step(self, loop: asyncio.AbstractEventLoop) -> None:
        """Let the clock of its readers wait for what it computes."""
        Lockstep.of(loop)

    def advance(self, until: float) -> None:
        """Move up to `until`, to the last tick that is not later."""
        while self._spin is not None and self._spin.due <= until + ROUNDING:
            self._sampling.advance(self._spin.due)
            self._spin.turn()
        self._sampling.advance(until)

    def supply(self, voltage: float) -> None:
        """The drives have this share of the battery's nominal voltage from now on. Raises `ValueError` for one that cannot be."""
        if not 0.0 <= voltage < inf:
            raise ValueError(
                f"The drives cannot be supplied with {voltage!r} of the nominal voltage: give a share of at least 0."
            )
        supplied, self._supplied = self._supplied, voltage > 0.0
        if supplied and not self._supplied:
            self._release()

    def actuators(self) -> ActuatorState:
        """Drives that do not get warm."""
        return ActuatorState(self._supplied, np.empty(0), 1.0)

    def sample(self, hz: float) -> None:
        """Take a sample `hz` times a second from now on."""
        self._sampling.begin(self.time, hz)

    def next_sample(self) -> Sample | None:
        """The oldest sample that waits."""
        return self._sampling.next()

    def imu(self) -> ImuSample:
        """The sample of this instant (the same one for every reader)."""
        if self._imu_read is None or self._imu_read[0] != self._ticks:
            exact = self._exact_imu()
            self._imu_read = (self._ticks, self._imu_noise.apply(exact.gyro, exact.accel) if self._noise else exact)
        return self._imu_read[1]

    def joints(self) -> JointSample:
        """The sample of this instant (the same one for every reader)."""
        if self._joints_read is None or self._joints_read[0] != self._ticks:
            sample = self._exact_joints()
            if self._noise:
                sample = replace(self._encoder_noise.apply(sample), contact=self._contact_noise.apply(sample.contact))
            self._joints_read = (self._ticks, sample)
        return self._joints_read[1]

    def lidar(self, beams: int = BEAMS, max_range: float = MAX_RANGE) -> Vector:
        """A scan of the scene's obstacles at the height of the body origin; the robot's own legs are never seen."""
        ranges = self._exact_ranges(beams, max_range)
        return self._lidar_noise.apply(ranges, max_range) if self._noise else ranges

    def sweep(self) -> Sweep | None:
        """The newest whole revolution."""
        if self._spin is None:
            return None
        if not self._spin.begun:
            self._spin.begin(self.time)
        return self._spin.take()

    def _look(self, rays: Floats) -> Floats:
        """What beams in these directions of the turning LiDAR measure now."""
        if not self._noise:
            return self._exact_rays(rays, MAX_RANGE)
        exact = self._exact_rays(np.asarray(rays @ self._lidar_noise.mount.T), MAX_RANGE)
        return self._lidar_noise.apply(exact, MAX_RANGE)

    def _sample(self) -> Sample:
        return Sample(self.time, self.imu(), self.joints())

    def _forget_samples(self) -> None:
        """The body was put elsewhere: what was measured at this instant does not hold."""
        self._imu_read = self._joints_read = None

    @abstractmethod
    def truth(self) -> Truth: ...

    @property
    @abstractmethod
    def power(self) -> float:
        """Electrical motor power now, W."""

    @abstractmethod
    def _integrate(self, until: float) -> None:
        """Move to the last tick that is not later than `until`, s."""

    @abstractmethod
    def _release(self) -> None:
        """Nobody commands the drives, or they have no current: let the robot sink."""

    @abstractmethod
    def _exact_imu(self) -> ImuSample: ...

    @abstractmethod
    def _exact_joints(self) -> JointSample:
        """Of this instant, in arrays that are the caller's own."""

    @abstractmethod
    def _exact_ranges(self, beams: int, max_range: float) -> Vector: ...

    @abstractmethod
    def _exact_rays(self, directions: Floats, max_range: float) -> Vector:
        """Ranges (m) from the body origin along unit vectors in body axes, shape (n, 3), to whatever is there."""
