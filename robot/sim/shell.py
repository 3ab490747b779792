"""What the simulated bodies share: the clock, the samples and their noise, the scene and its things."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmDevice
from robot.hardware.beams import BEAMS, MAX_RANGE
from robot.hardware.body import NO_REPLAY, ImuSample, JointSample, Sample, Truth
from robot.scenes.scene import Obstacle, Scene, Thing
from robot.sim.charger import charger_connected
from robot.sim.noise import ContactNoise, EncoderNoise, ImuNoise, LidarNoise
from robot.sim.sampling import Sampling

__all__ = ["LOST_COMMAND_TICKS", "TICK", "BodyShell", "SimulatedArm"]

TICK = 0.0005
"""Every instant of a body is a whole number of these, s: readers that come a little apart do not chop the simulation up."""
LOST_COMMAND_TICKS = 200
"""Ticks without a command (0.1 s) after which a body is on its own."""


class SimulatedArm(ArmDevice, Protocol):
    """An arm that also knows where the scene's things are."""

    def things(self) -> tuple[Thing, ...]: ...


class BodyShell(ABC):
    """The part of a body that is the same whatever moves it: an heir integrates its motion and tells exact measurements.

    Its time is a whole number of ticks and never goes back. At one instant every reader gets the same sample of IMU and of joints: noise is
    drawn once.
    """

    no_replay = NO_REPLAY

    def __init__(self, scene: Scene, *, seed: int, noise: bool) -> None:
        self._scene, self._noise = scene, noise
        self._imu_noise, self._encoder_noise = ImuNoise(seed), EncoderNoise(seed)
        self._contact_noise, self._lidar_noise = ContactNoise(seed), LidarNoise(seed)
        self._imu_read: tuple[int, ImuSample] | None = None
        self._joints_read: tuple[int, JointSample] | None = None
        self._ticks: int = 0
        self._sampling = Sampling(self._integrate, self._sample)

    @property
    def scene(self) -> Scene:
        return self._scene

    @property
    def time(self) -> float:
        return self._ticks * TICK

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

    def advance(self, until: float) -> None:
        """Move up to `until`, to the last tick that is not later."""
        self._sampling.advance(until)

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
                position, velocity = self._encoder_noise.apply(sample.position, sample.velocity)
                contact = self._contact_noise.apply(sample.contact)
                sample = JointSample(position, velocity, sample.effort, contact)
            self._joints_read = (self._ticks, sample)
        return self._joints_read[1]

    def lidar(self, beams: int = BEAMS, max_range: float = MAX_RANGE) -> Vector:
        """A scan of the scene's obstacles at the height of the body origin; the robot's own legs are never seen."""
        ranges = self._exact_ranges(beams, max_range)
        return self._lidar_noise.apply(ranges, max_range) if self._noise else ranges

    def _sample(self) -> Sample:
        return Sample(self.time, self.imu(), self.joints())

    def _forget_samples(self) -> None:
        """The body was put elsewhere: what was measured at this instant does not hold."""
        self._imu_read = self._joints_read = None

    @abstractmethod
    def truth(self) -> Truth: ...

    @abstractmethod
    def _integrate(self, until: float) -> None:
        """Move to the last tick that is not later than `until`, s."""

    @abstractmethod
    def _exact_imu(self) -> ImuSample: ...

    @abstractmethod
    def _exact_joints(self) -> JointSample:
        """Of this instant, in arrays that are the caller's own."""

    @abstractmethod
    def _exact_ranges(self, beams: int, max_range: float) -> Vector: ...
