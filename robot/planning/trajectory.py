"""Joint motions that keep limits of speed, acceleration and jerk: from rest to rest, and from motion to rest.

Rest to rest is the quintic s(u) = 10 u^3 - 15 u^4 + 6 u^5, stretched until its peaks (15/8 of speed, 10/sqrt(3) of
acceleration, 60 of jerk, per travel and duration) fit every joint's limits: about 1.2 times the shortest possible time.
Stopping is the shortest possible for each joint by itself: jerk at its limit, acceleration held at its limit, jerk
back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cbrt, copysign, sqrt
from typing import NamedTuple, Protocol

import numpy as np

from robot.geometry.vectors import Vector

Phases = tuple[float, float, float]

PEAK_SPEED, PEAK_ACCELERATION, PEAK_JERK = 15 / 8, 10 / sqrt(3), 60.0


class MotionLimits(NamedTuple):
    """Largest speed (rad/s), acceleration (rad/s2) and jerk (rad/s3) of each joint, either way."""

    speed: Vector
    acceleration: Vector
    jerk: Vector


ARM_LIMITS = MotionLimits(
    np.array([2.0, 2.0, 2.5, 3.0]), np.array([8.0, 8.0, 10.0, 12.0]), np.array([80.0, 80.0, 100.0, 120.0])
)


class Point(NamedTuple):
    """One instant of a motion: rad, rad/s, rad/s2; shape (joints,) each."""

    position: Vector
    velocity: Vector
    acceleration: Vector


class Motion(Protocol):
    """A motion of all joints over time."""

    @property
    def duration(self) -> float:
        """Seconds until it is at rest."""
        ...

    def at(self, time: float) -> Point:
        """The state `time` seconds after the start; at rest at the end's position from `duration` on."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Quintic:
    """From rest at `start` to rest at `target`, all joints together on a straight line in joint space."""

    start: Vector
    target: Vector
    duration: float

    @classmethod
    def between(cls, start: Vector, target: Vector, limits: MotionLimits = ARM_LIMITS) -> Quintic:
        """The fastest such motion that keeps `limits`; of duration zero if there is nowhere to go."""
        travel = np.abs(target - start)
        duration = max(
            float((PEAK_SPEED * travel / limits.speed).max()),
            sqrt(float((PEAK_ACCELERATION * travel / limits.acceleration).max())),
            cbrt(float((PEAK_JERK * travel / limits.jerk).max())),
        )
        return cls(start.copy(), target.copy(), duration)

    def progress(self, time: float) -> float:
        """The share of the way covered, 0..1; never falls."""
        u = self._share(time)
        return u * u * u * (10.0 + u * (6.0 * u - 15.0))  # formula: minimum-jerk quintic

    def at(self, time: float) -> Point:
        u, way = self._share(time), self.target - self.start
        if u == 1.0:
            rest = np.zeros_like(self.target)
            return Point(self.target.copy(), rest, rest)
        rate = 30.0 * u * u * (u - 1.0) ** 2 / self.duration  # formula: its derivative
        bend = 60.0 * u * (u - 1.0) * (2.0 * u - 1.0) / self.duration**2  # formula: its second derivative
        return Point(self.start + way * self.progress(time), way * rate, way * bend)

    def _share(self, time: float) -> float:
        """The share of the duration that has passed, 0..1."""
        if time >= self.duration or self.duration == 0.0:
            return 1.0
        return max(0.0, time / self.duration)


class Stop:
    """From any motion to rest, each joint as fast as its acceleration and jerk limits allow."""

    __slots__ = ("_jerks", "_start", "_times", "duration")

    def __init__(self, start: Point, limits: MotionLimits = ARM_LIMITS) -> None:
        self._start = start
        joints = zip(start.velocity, start.acceleration, limits.acceleration, limits.jerk, strict=True)
        profiles = [_stop(*(float(value) for value in joint)) for joint in joints]
        self._times = np.array([times for times, _ in profiles]).reshape(-1, 3)
        self._jerks = np.array([jerks for _, jerks in profiles]).reshape(-1, 3)
        self.duration = float(self._times.sum(axis=1).max())
        """Seconds until the last joint rests."""

    def at(self, time: float) -> Point:
        """The state `time` seconds after the start of braking."""
        q, v, a = (part.copy() for part in self._start)
        left = np.full_like(q, max(0.0, time))
        for phase in range(3):
            t = np.minimum(left, self._times[:, phase])
            jerk = self._jerks[:, phase]
            q = q + t * (v + t * (a / 2 + t * jerk / 6))
            v = v + t * (a + t * jerk / 2)
            a = a + t * jerk
            left = left - t
        resting = self._times.sum(axis=1) <= time
        return Point(q, np.where(resting, 0.0, v), np.where(resting, 0.0, a))


def _stop(v: float, a: float, most: float, jerk: float) -> tuple[Phases, Phases]:
    """Times and jerks of the three phases: build up braking, hold it, let it go.

    `away` is the speed that would be left if the acceleration alone were taken back at once: brake against it. The
    peak p of braking follows from the speed to lose: p^2 = a^2/2 + jerk v, both counted along `away`.
    """
    away = v + a * abs(a) / (2.0 * jerk)
    side = copysign(1.0, away)
    v, a = side * v, side * a
    peak, hold = sqrt(max(0.0, a * a / 2.0 + jerk * v)), 0.0
    if peak > most:
        peak = most
        hold = (v + a * a / (2.0 * jerk) - most * most / jerk) / most
    build = max(0.0, (a + peak) / jerk)
    return (build, hold, peak / jerk), (-side * jerk, 0.0, side * jerk)
