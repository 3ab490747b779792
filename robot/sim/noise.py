"""Seeded noise of the sensors, the same for every back end: same seed and same calls give the same stream.

Constants are those of the MEMS IMU of the EuRoC data sets and of joint encoders (docs/control.md#sensor-models). Discretisation: white noise
of density n has the standard deviation ``n * sqrt(rate)``; a bias that walks with density w makes steps of ``w / sqrt(rate)``.
"""

from __future__ import annotations

import math
import zlib
from collections import deque

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Vector
from robot.hardware.body import ImuSample

__all__ = ["BiasedNoise", "ContactNoise", "EncoderNoise", "ImuNoise", "LidarNoise", "sensor_generator"]

GYRO_WHITE, GYRO_WALK, GYRO_BIAS = 1.7e-4, 1.9e-5, 1e-3
"""rad/s/sqrt(Hz), rad/s2/sqrt(Hz), rad/s."""
ACCEL_WHITE, ACCEL_WALK, ACCEL_BIAS = 2.0e-3, 3.0e-3, 0.02
"""m/s2/sqrt(Hz), m/s3/sqrt(Hz), m/s2."""


def sensor_generator(seed: int, sensor: str) -> np.random.Generator:
    """A random stream that belongs to one sensor of one robot: adding a sensor never changes the others' noise."""
    return np.random.default_rng([seed, zlib.crc32(sensor.encode())])


class BiasedNoise:
    """White noise plus a bias that starts random and walks, on three axes.

    `white` is the noise density (unit/sqrt(Hz)), `walk` the density of the bias walk (unit/s/sqrt(Hz)), `bias` the
    standard deviation of the bias at the start (unit), `rate` the sample rate (Hz). One `apply` is one sample.
    """

    __slots__ = ("_bias", "_generator", "_step", "_white")

    def __init__(self, generator: np.random.Generator, rate: float, *, white: float, walk: float, bias: float) -> None:
        _check_rate(rate)
        self._generator = generator
        self._white = white * math.sqrt(rate)
        self._step = walk / math.sqrt(rate)
        self._bias: Vector = generator.normal(0.0, bias, 3)

    @property
    def bias(self) -> Vector:
        """The true bias of the latest sample, shape (3,); for judges of an estimator or a calibration."""
        return self._bias.copy()

    def apply(self, true: Vector) -> Vector:
        """The next sample of a sensor whose true value, shape (3,), is `true`."""
        draw = self._generator.standard_normal((2, 3))
        self._bias = self._bias + self._step * draw[0]
        return np.asarray(true + self._bias + self._white * draw[1], dtype=np.float64)


class ImuNoise:
    """Gyro and accelerometer of one IMU, sampled at `rate` Hz; each has a generator of its own."""

    __slots__ = ("accel", "gyro")

    def __init__(self, seed: int, rate: float = 200.0) -> None:
        self.gyro = BiasedNoise(sensor_generator(seed, "gyro"), rate, white=GYRO_WHITE, walk=GYRO_WALK, bias=GYRO_BIAS)
        self.accel = BiasedNoise(
            sensor_generator(seed, "accelerometer"), rate, white=ACCEL_WHITE, walk=ACCEL_WALK, bias=ACCEL_BIAS
        )

    def apply(self, gyro: Vector, accel: Vector) -> ImuSample:
        """The next sample for a true angular velocity (rad/s) and specific force (m/s2), body axes, shape (3,) each."""
        return ImuSample(gyro=self.gyro.apply(gyro), accel=self.accel.apply(accel))


class EncoderNoise:
    """White noise on joint positions (sd 5e-4 rad) and joint speeds (sd 0.05 rad/s); each sample is independent."""

    __slots__ = ("_generator", "_position", "_velocity")

    def __init__(self, seed: int, *, position: float = 5e-4, velocity: float = 0.05) -> None:
        self._generator = sensor_generator(seed, "encoders")
        self._position = position
        self._velocity = velocity

    def apply(self, position: Vector, velocity: Vector) -> tuple[Vector, Vector]:
        """The next sample for the true positions (rad) and speeds (rad/s), both of one shape."""
        draw = self._generator.standard_normal((2, *position.shape))
        return position + self._position * draw[0], velocity + self._velocity * draw[1]


class LidarNoise:
    """White noise on ranges, sd 0.015 m by default; a beam without return stays without return."""

    __slots__ = ("_generator", "_sd")

    def __init__(self, seed: int, *, sd: float = 0.015) -> None:
        self._generator = sensor_generator(seed, "lidar")
        self._sd = sd

    def apply(self, ranges: Vector, max_range: float) -> Vector:
        """The next scan for the true `ranges` (m), any shape; the result lies in [0, max_range].

        A range of `max_range` or more means no return and becomes exactly `max_range`. The number of draws does not
        depend on what is hit, so worlds that differ in one box give the same noise elsewhere.
        """
        noisy = np.clip(ranges + self._sd * self._generator.standard_normal(ranges.shape), 0.0, max_range)
        return np.where(ranges >= max_range, max_range, noisy)


class ContactNoise:
    """Foot contacts that arrive `delay` seconds late (rounded to samples) and are dropped with probability `dropout`.

    The defaults of zero leave contacts untouched; the tests use 10 ms and 1 %.
    """

    __slots__ = ("_dropout", "_generator", "_waiting")

    def __init__(self, seed: int, rate: float = 200.0, *, delay: float = 0.0, dropout: float = 0.0) -> None:
        _check_rate(rate)
        if delay < 0.0 or not 0.0 <= dropout <= 1.0:
            raise ValueError(
                f"Contact noise got delay {delay!r} s and dropout {dropout!r}: "
                "give a delay of at least 0 and a dropout from 0 to 1."
            )
        self._generator = sensor_generator(seed, "contacts")
        self._dropout = dropout
        self._waiting: deque[NDArray[np.bool_]] = deque(maxlen=round(delay * rate) + 1)

    def apply(self, contact: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The next sample; `contact` has shape (4,). Until the delay has passed, the first sample is repeated."""
        self._waiting.append(contact.copy())
        kept = self._generator.random(contact.shape) >= self._dropout
        return self._waiting[0] & kept


def _check_rate(rate: float) -> None:
    if not (math.isfinite(rate) and rate > 0.0):
        raise ValueError(f"A sensor's sample rate must be a positive number of hertz, not {rate!r}.")
