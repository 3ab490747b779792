"""The gyro's bias, estimated from rest, from gravity, and from the line between two standing feet, which does not turn.

Equations and sources: docs/concepts/control.md#gyro-bias.
"""

from __future__ import annotations

from math import atan2

from robot.geometry.angles import wrap
from robot.geometry.vectors import Triple

FIRST = 1e-3
"""Standard deviation of the bias before anything is known, rad/s."""
WALK = 1.9e-5
"""Density of the bias's random walk, rad/s per root second."""
WHITE = 1.7e-4
"""Noise density of the gyro, rad/s/sqrt(Hz): at 200 Hz one sample has a standard deviation of 2.4e-3 rad/s."""
STILL_RATE = 0.012
"""A robot that is said to stand still and shows more than this (rad/s) does not."""
GRAVITY_GAIN = 0.004
"""Integral gain of the horizon's error in the attitude filter, 1/s2."""


class GyroBias:
    """Three biases with their uncertainties: a scalar Kalman filter for each axis. rad/s, body axes."""

    __slots__ = ("_variance", "value")

    def __init__(self) -> None:
        self.value: Triple = (0.0, 0.0, 0.0)
        self._variance = [FIRST**2] * 3

    @property
    def deviation(self) -> Triple:
        """Standard deviation of each bias as the filter believes it, rad/s."""
        a, b, c = (variance**0.5 for variance in self._variance)
        return (a, b, c)

    def wander(self, dt: float) -> None:
        """Prediction over `dt` seconds: the random walk widens the variances."""
        for axis in range(3):
            self._variance[axis] += WALK**2 * dt

    def rest(self, dt: float, gyro: Triple) -> None:
        """Update of a robot at rest for `dt` seconds: the gyro measures its bias, with white noise, unless the innovation is too large for rest."""
        if max(abs(shown - bias) for shown, bias in zip(gyro, self.value, strict=True)) < STILL_RATE:
            x, y, z = (self._kalman_update(axis, gyro[axis], WHITE**2 / dt) for axis in range(3))
            self.value = (x, y, z)

    def lean(self, dt: float, ex: float, ey: float) -> None:
        """Integral part of the attitude filter: the horizon is off by this much (rad about body x and y). The variances are not touched."""
        x, y, z = self.value
        self.value = (x - GRAVITY_GAIN * ex * dt, y - GRAVITY_GAIN * ey * dt, z)

    def seen(self, step: float) -> None:
        """The bias about the vertical is larger by `step` (rad/s), as scans show. The variances are not touched."""
        x, y, z = self.value
        self.value = (x, y, z + step)

    def turning(self, rate: float, variance: float) -> None:
        """Update about the vertical: what does not turn seemed to, at `rate` (rad/s, of this variance), so the bias is off by so much."""
        x, y, z = self.value
        self.value = (x, y, self._kalman_update(2, z + rate, variance))

    def _kalman_update(self, axis: int, measured: float, noise: float) -> float:
        """Scalar Kalman update of one axis: `noise` is the variance R of the measurement; returns the new mean."""
        variance = self._variance[axis]
        gain = variance / (variance + noise)
        self._variance[axis] = (1.0 - gain) * variance
        return self.value[axis] + gain * (measured - self.value[axis])


class FootLine:
    """The line between two standing feet, as odom sees it. If it turns, the gyro's bias is wrong by that rate.

    A straight line is fitted through the angle over one common stance of exactly two feet; the feet's own rolling is taken out.
    """

    LEAST = 0.1
    """Least length of a common stance, s: the variance of a slope falls with its cube."""
    ANGLE_NOISE = 6e-4
    """Standard deviation of one sample of the angle, rad: encoders of 5e-4 rad over 0.7 m."""
    CREEP = 2e-4
    """Standard deviation that the feet's creep on the ground adds to a rate, rad/s."""
    FASTEST = 0.02
    """A rate beyond this is an outlier, rad/s: a foot slipped."""

    def __init__(self) -> None:
        self._pair = (-1, -1)
        self._clear()

    def _clear(self) -> None:
        self._first = self._rolled = 0.0
        self._count = 0
        self._time = 0.0
        """Seconds since the first sample of this stance."""
        self._t = self._tt = self._a = self._ta = 0.0

    def update(self, dt: float, pair: tuple[int, int], arm: Triple, roll: Triple) -> tuple[float, float] | None:
        """Add the vector between the two feet and the difference of their rolling velocities, odom axes.

        Returns rate and variance when a stance has ended that told something. `pair` (-1, -1): not just two feet stand firmly.
        """
        fit = None
        if pair != self._pair:
            fit = self._fit()
            self._pair = pair
            self._clear()
        if pair[0] < 0:
            return fit
        x, y, _ = arm
        angle = atan2(y, x)
        if self._count == 0:
            self._first = angle
        else:
            self._time += dt
            self._rolled += (x * roll[1] - y * roll[0]) / (x * x + y * y) * dt
        turned = wrap(angle - self._first) - self._rolled
        time = self._time
        self._t += time
        self._tt += time * time
        self._a += turned
        self._ta += time * turned
        self._count += 1
        return fit

    def _fit(self) -> tuple[float, float] | None:
        """Least squares of the angle over time: the slope, and its variance."""
        count = self._count
        if self._time < self.LEAST:
            return None
        moment = self._tt - self._t * self._t / count
        rate = (self._ta - self._t * self._a / count) / moment
        if abs(rate) > self.FASTEST:
            return None
        return rate, self.ANGLE_NOISE**2 / moment + self.CREEP**2
