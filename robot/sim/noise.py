"""Seeded noise of the sensors, the same for every back end: same seed and same calls give the same stream.

Constants are those of the MEMS IMU of the EuRoC data sets and of joint encoders (docs/concepts/control.md#sensor-models). Discretisation: white noise
of density n has the standard deviation ``n * sqrt(rate)``; a bias that walks with density w makes steps of ``w / sqrt(rate)``, and
goes back to what it was at the start with the time constant `MEMORY`: a walk without that, which a data sheet gives for minutes, would be ten times what any
IMU has after hours.
"""

from __future__ import annotations

import math
import zlib
from collections import deque

import numpy as np
from numpy.typing import NDArray

from actors.tf2 import Transform
from robot.geometry.vectors import Floats, Vector
from robot.hardware.body import ImuSample, JointSample
from robot.hardware.sensors import ContactErrors, EncoderErrors, ImuErrors, LidarErrors

GYRO_WHITE, GYRO_WALK, GYRO_BIAS = 1.7e-4, 1.9e-5, 1e-3
"""rad/s/sqrt(Hz), rad/s2/sqrt(Hz), rad/s."""
ACCEL_WHITE, ACCEL_WALK, ACCEL_BIAS = 2.0e-3, 3.0e-3, 0.02
"""m/s2/sqrt(Hz), m/s3/sqrt(Hz), m/s2."""
MEMORY = 1000.0
"""Time constant with which a bias goes back to what it was at the start, s: a Gauss-Markov process."""


def sensor_generator(seed: int, sensor: str) -> np.random.Generator:
    """A random stream that belongs to one sensor of one robot: adding a sensor never changes the others' noise."""
    return np.random.default_rng([seed, zlib.crc32(sensor.encode())])


class BiasedNoise:
    """White noise plus a bias that starts random and walks about where it started, on three axes.

    `white` is the noise density (unit/sqrt(Hz)), `walk` the density of the bias walk (unit/s/sqrt(Hz)), `bias` the
    standard deviation of the bias at the start (unit), `rate` the sample rate (Hz). One `apply` is one sample.
    """

    __slots__ = ("_bias", "_generator", "_keep", "_start", "_step", "_white")

    def __init__(self, generator: np.random.Generator, rate: float, *, white: float, walk: float, bias: float) -> None:
        _check_rate(rate)
        self._generator = generator
        self._white = white * math.sqrt(rate)
        self._step = walk / math.sqrt(rate)
        self._keep = _kept(rate)
        self._start: Vector = generator.normal(0.0, bias, 3)
        self._bias = self._start

    @property
    def bias(self) -> Vector:
        """The true bias of the latest sample, shape (3,); for judges of an estimator or a calibration."""
        return self._bias.copy()

    def apply(self, true: Vector) -> Vector:
        """The next sample of a sensor whose true value, shape (3,), is `true`."""
        draw = self._generator.standard_normal((2, 3))
        self._bias = self._start + self._keep * (self._bias - self._start) + self._step * draw[0]
        return np.asarray(true + self._bias + self._white * draw[1], dtype=np.float64)


class BiasSteps:
    """A bias on three axes that changes at once, by a normal draw of `sd`, at random instants `every` seconds apart on average, and goes back to zero."""

    __slots__ = ("_generator", "_keep", "_rarity", "_sd", "value")

    def __init__(self, generator: np.random.Generator, rate: float, *, sd: float, every: float) -> None:
        _check_rate(rate)
        self._generator = generator
        self._rarity, self._sd, self._keep = 1.0 / (every * rate), sd, _kept(rate)
        self.value: Vector = np.zeros(3)

    def advance(self) -> Vector:
        """The value at the next sample, shape (3,)."""
        if self._sd == 0.0:
            return self.value
        self.value = self._keep * self.value
        if self._generator.random() < self._rarity:
            self.value = self.value + self._generator.normal(0.0, self._sd, 3)
        return self.value


class ImuNoise:
    """Gyro and accelerometer of one IMU, sampled at `rate` Hz; each has generators of its own."""

    __slots__ = ("_accel_axes", "_accel_steps", "_gyro_axes", "_gyro_steps", "accel", "gyro")

    def __init__(self, seed: int, rate: float = 200.0, errors: ImuErrors | None = None) -> None:
        wrong = errors or ImuErrors()
        self.gyro = BiasedNoise(sensor_generator(seed, "gyro"), rate, white=GYRO_WHITE, walk=GYRO_WALK, bias=GYRO_BIAS)
        self.accel = BiasedNoise(
            sensor_generator(seed, "accelerometer"), rate, white=ACCEL_WHITE, walk=ACCEL_WALK, bias=ACCEL_BIAS
        )
        self._gyro_steps, self._accel_steps = (
            BiasSteps(sensor_generator(seed, f"{name} steps"), rate, sd=sd, every=wrong.step_every)
            for name, sd in (("gyro", wrong.gyro_step), ("accelerometer", wrong.accel_step))
        )
        self._gyro_axes, self._accel_axes = (
            _axes(sensor_generator(seed, f"{name} axes"), wrong) for name in ("gyro", "accelerometer")
        )

    @property
    def gyro_bias(self) -> Vector:
        """The true bias of the gyro's latest sample, shape (3,), rad/s; for judges of an estimator or a calibration."""
        return self.gyro.bias + self._gyro_steps.value

    def apply(self, gyro: Vector, accel: Vector) -> ImuSample:
        """The next sample for a true angular velocity (rad/s) and specific force (m/s2), body axes, shape (3,) each."""
        return ImuSample(
            gyro=self.gyro.apply(self._gyro_axes @ gyro + self._gyro_steps.advance()),
            accel=self.accel.apply(self._accel_axes @ accel + self._accel_steps.advance()),
        )


class EncoderNoise:
    """White noise on joint positions, speeds and torques, each sample independent; the zeros are off by what they were at the beginning."""

    __slots__ = ("_effort", "_generator", "_position", "_torque", "_velocity", "_zeros")

    def __init__(self, seed: int, errors: EncoderErrors | None = None, joints: int = 12) -> None:
        wrong = errors or EncoderErrors()
        self._generator, self._torque = sensor_generator(seed, "encoders"), sensor_generator(seed, "joint torques")
        self._position, self._velocity, self._effort = wrong.position, wrong.velocity, wrong.effort
        self._zeros: Vector = wrong.zero_sd * sensor_generator(seed, "encoder zeros").standard_normal(joints)

    def apply(self, true: JointSample) -> JointSample:
        """The next sample; its contacts are the true ones."""
        draw = self._generator.standard_normal((2, *true.position.shape))
        effort = true.effort
        if self._effort > 0.0:
            effort = effort + self._effort * self._torque.standard_normal(effort.shape)
        return JointSample(
            true.position + self._zeros + self._position * draw[0], true.velocity + self._velocity * draw[1], effort, true.contact
        )  # fmt: skip


class LidarNoise:
    """White noise, bias and drop-outs of a LiDAR's ranges, and its lean on its mount; a beam without return stays without return."""

    __slots__ = ("_bias", "_dropout", "_generator", "_lost", "_sd", "mount")

    def __init__(self, seed: int, errors: LidarErrors | None = None) -> None:
        wrong = errors or LidarErrors()
        self._generator, self._lost = sensor_generator(seed, "lidar"), sensor_generator(seed, "lidar drop-outs")
        once = sensor_generator(seed, "lidar mount")
        self._sd, self._dropout = wrong.noise, wrong.dropout
        self._bias = wrong.bias * float(once.uniform(-1.0, 1.0))
        roll, pitch, yaw = (wrong.misalignment_sd * once.standard_normal(3)).tolist()
        self.mount: Floats = Transform.from_rpy((0.0, 0.0, 0.0), roll, pitch, yaw).matrix
        """Rotation from the sensor's axes to those of the body, shape (3, 3)."""

    def apply(self, ranges: Vector, max_range: float) -> Vector:
        """The next scan for the true `ranges` (m), any shape; the result lies in [0, max_range].

        A range of `max_range` or more means no return and becomes exactly `max_range`. The number of draws does not
        depend on what is hit, so worlds that differ in one box give the same noise elsewhere.
        """
        noise = self._bias + self._sd * self._generator.standard_normal(ranges.shape)
        nothing = ranges >= max_range
        if self._dropout > 0.0:
            nothing = nothing | (self._lost.random(ranges.shape) < self._dropout)
        return np.where(nothing, max_range, np.clip(ranges + noise, 0.0, max_range))


class ContactNoise:
    """Foot contacts that arrive late (rounded to samples), and now and then not at all. Without errors they are left as they are."""

    __slots__ = ("_dropout", "_generator", "_waiting")

    def __init__(self, seed: int, rate: float = 200.0, errors: ContactErrors | None = None) -> None:
        _check_rate(rate)
        wrong = errors or ContactErrors()
        self._generator = sensor_generator(seed, "contacts")
        self._dropout = wrong.dropout
        self._waiting: deque[NDArray[np.bool_]] = deque(maxlen=round(wrong.delay * rate) + 1)

    def apply(self, contact: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The next sample; `contact` has shape (4,). Until the delay has passed, the first sample is repeated."""
        self._waiting.append(contact.copy())
        kept = self._generator.random(contact.shape) >= self._dropout
        return self._waiting[0] & kept


def _axes(generator: np.random.Generator, errors: ImuErrors) -> Floats:
    """What turns true values into those along axes that lean and have each a scale of its own, shape (3, 3)."""
    scale, lean = generator.standard_normal(3), generator.standard_normal((3, 3))
    return np.eye(3) + np.where(np.eye(3, dtype=bool), errors.scale_sd * scale, errors.misalignment_sd * lean)


def _kept(rate: float) -> float:
    """Share of its way from the start that a bias keeps from one sample to the next."""
    return math.exp(-1.0 / (MEMORY * rate))


def _check_rate(rate: float) -> None:
    if not (math.isfinite(rate) and rate > 0.0):
        raise ValueError(f"A sensor's sample rate must be a positive number of hertz, not {rate!r}.")
