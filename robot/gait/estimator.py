"""Where the robot is and how fast it moves, from IMU, encoders and foot contacts alone (the `odom` frame).

Attitude comes from `AttitudeFilter`. Position and velocity come from a Kalman filter over body position, body velocity and the
four foot points: predicted with the accelerometer, corrected by what standing feet say (robot-domain section 6, with the
rolling of the ball feet). The three axes share their model and noise, so one 6 x 6 covariance serves all three.

Height over flat ground cannot be observed: a prior pulls the standing feet to height zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, exp

import numpy as np
from numpy.typing import NDArray

from robot.gait.attitude import AttitudeFilter
from robot.gait.figures import FOOT_RADIUS, GRAVITY
from robot.gait.gyro_bias import FootLine
from robot.gait.limbs import Limbs, Triple, foot_velocities, limbs
from robot.world.body import ImuSample, JointSample, Vector

__all__ = ["Estimator"]

PLACE_NOISE = 0.004
"""Standard deviation (m) of a foot's place as the encoders tell it."""
SPEED_NOISE = 0.06
"""Standard deviation (m/s) of the body's velocity as one standing foot tells it."""
ACCEL_NOISE = 0.6
"""Standard deviation (m/s2) of the accelerometer in a walking body."""
SLIDE_NOISE = 0.002
"""How far (m per sample, standard deviation) a standing foot may creep."""
DOUBT = 31.0
"""Factor on the variance of a foot that has just landed, is about to lift or seems to slip."""
SETTLING = 0.02
"""Seconds a foot counts as just landed."""
FIRM = 0.03
"""Seconds after which a landed foot stands firmly enough to tell about turning."""
SLOW_TURN = 0.3
"""A robot that turns faster (rad/s) twists its feet on the ground: they say nothing about the gyro then."""
_NOWHERE: Triple = (0.0, 0.0, 0.0)
SLIP = 0.35
"""A standing foot that differs from the rest by this speed (m/s) is doubted."""
FLOOR_TIME = 0.5
"""Time constant (s) of the prior that standing feet are at height zero."""
OWN_ACCEL_TIME = 0.15
"""Time constant (s) of the robot's own acceleration, told from its velocity, that the attitude filter subtracts."""


class Estimator:
    """The state of the body at the latest sample. `update` once per control step.

    The odom frame starts under the robot at the first sample, x forward. Until `update` has been called once, everything is zero.
    """

    def __init__(self) -> None:
        self.attitude = AttitudeFilter()
        self.rotation: Vector = np.eye(3)
        self.position: Vector = np.zeros(3)
        """Body origin in odom, m; z is the height above the standing feet's soles."""
        self.velocity: Vector = np.zeros(3)
        """Body origin in odom axes, m/s."""
        self.contact: tuple[bool, ...] = (False,) * 4
        self.legs: Limbs = limbs((0.0,) * 12, (0.0, 0.0, 1.0))
        self.footholds: Vector = np.zeros((4, 3))
        """Foot centres in odom as the filter believes them, shape (4, 3), m."""
        self.contacts: Vector = np.zeros((4, 3))
        """Where each foot's centre was when it last stood, odom, shape (4, 3), m."""
        self.own_acceleration: Vector = np.zeros(3)
        self._state = np.zeros((6, 3))
        self._spread = np.diag([1e-6, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])
        self._standing_for = [0.0] * 4
        self._smooth_velocity = np.zeros(3)
        self._line = FootLine()
        self._started = False

    def update(
        self,
        dt: float,
        imu: ImuSample,
        joints: JointSample,
        leaving: Sequence[bool] = (False,) * 4,
        still: bool = False,
    ) -> None:
        """Take in one sample, `dt` seconds after the last.

        `leaving` marks feet about to lift (they are doubted); `still` says that the robot is meant to stand at rest.
        """
        gyro, accel = _triple(imu.gyro), _triple(imu.accel)
        angles, speeds = joints.position.tolist(), joints.velocity.tolist()
        if not self._started:
            self.attitude.level(accel)
        own = self.own_acceleration @ self.rotation
        self.attitude.update(dt, gyro, accel, _triple(own), still)
        up = self.attitude.up
        self.rotation = rotation = np.array(self.attitude.rotation)
        self.legs = limbs(angles, up)
        moving, rolling = foot_velocities(self.legs, angles, speeds, self.attitude.turn, up)
        self.contact = tuple(joints.contact.tolist())
        arms = np.array(self.legs.feet) @ rotation.T
        if not self._started:
            self._begin(arms)
        roll = np.array(rolling) @ rotation.T
        force = rotation @ imu.accel
        force[2] -= GRAVITY
        self._predict(dt, force, roll)
        told = roll - np.array(moving) @ rotation.T
        self._correct(dt, arms, told, leaving)
        if still and not any(self.contact):
            self._rest()
        self._pin_height(dt)
        self._watch_acceleration(dt, told)
        self._watch_heading(dt, arms, roll, leaving)

    def _begin(self, arms: Vector) -> None:
        self._started = True
        self._state[0, 2] = -arms[:, 2].mean()
        self._state[2:] = self._state[0] + arms
        self.contacts = self._state[2:].copy()

    def _predict(self, dt: float, acceleration: Vector, roll: Vector) -> None:
        state, spread = self._state, self._spread
        state[0] += state[1] * dt + acceleration * (0.5 * dt * dt)
        state[1] += acceleration * dt
        state[2:] += roll * dt
        spread[0] += dt * spread[1]
        spread[:, 0] += dt * spread[:, 1]
        spread.flat[7] += (ACCEL_NOISE * dt) ** 2
        spread.flat[14::7] += SLIDE_NOISE**2

    def _correct(self, dt: float, arms: Vector, told: Vector, leaving: Sequence[bool]) -> None:
        state, spread = self._state, self._spread
        standing: list[int] = []
        doubt: list[float] = []
        velocity, speeds = state[1].tolist(), told.tolist()
        for leg in range(4):
            if not self.contact[leg]:
                self._standing_for[leg] = 0.0
                continue
            if self._standing_for[leg] == 0.0:
                self._land(leg, arms[leg])
            self._standing_for[leg] += dt
            standing.append(leg)
            slip = dist(speeds[leg], velocity) > SLIP
            landing = self._standing_for[leg] < SETTLING
            doubt.append(DOUBT if slip or landing or leaving[leg] else 1.0)
        if standing:
            rows, legs, variance = _OBSERVE[tuple(standing)]
            gap = np.concatenate((arms[legs] - state[legs + 2] + state[0], told[legs] - state[1]))
            seen = rows @ spread
            innovation = seen @ rows.T
            innovation.flat[:: 2 * len(standing) + 1] += variance * np.array(doubt + doubt)
            gain = np.linalg.solve(innovation, seen)
            state += gain.T @ gap
            spread -= seen.T @ gain
            spread += spread.T  # rounding makes it unsymmetric, and what is unsymmetric grows
            spread *= 0.5
        for leg in range(4):
            if self.contact[leg]:
                self.contacts[leg] = state[leg + 2]
            else:
                state[leg + 2] = state[0] + arms[leg]
        self.position, self.velocity, self.footholds = state[0].copy(), state[1].copy(), state[2:].copy()

    def _land(self, leg: int, arm: Vector) -> None:
        """A foot touches down: its place is where the leg says, as uncertain as the body plus the encoders."""
        self._state[leg + 2] = self._state[0] + arm
        self._spread[leg + 2] = self._spread[0]
        self._spread[:, leg + 2] = self._spread[:, 0]
        self._spread[leg + 2, leg + 2] = self._spread[0, 0] + PLACE_NOISE**2 * DOUBT

    def _pin_height(self, dt: float) -> None:
        """Shift body and feet together, so that nothing the filter observes changes."""
        feet: list[float] = self._state[2:, 2].tolist()
        heights = [height - FOOT_RADIUS for height, stands in zip(feet, self.contact, strict=True) if stands]
        if heights:
            shift = sum(heights) / len(heights) * min(1.0, dt / FLOOR_TIME)
            self._state[0, 2] -= shift
            self._state[2:, 2] -= shift
            self.contacts[:, 2] -= shift

    def _rest(self) -> None:
        """The robot lies on its skid: no foot says so, but it does not move."""
        self._state[1] = 0.0
        self._spread[1, :] = self._spread[:, 1] = 0.0
        self._spread[1, 1] = 1e-4
        self.velocity = np.zeros(3)

    def _watch_acceleration(self, dt: float, told: Vector) -> None:
        """From what standing feet say alone: the filtered velocity contains the accelerometer and would agree with it."""
        count = sum(self.contact)
        if count == 0:
            self.own_acceleration *= 1.0 - dt / OWN_ACCEL_TIME
            return
        blend = 1.0 - exp(-dt / OWN_ACCEL_TIME)
        change = (np.array(self.contact, dtype=float) @ told / count - self._smooth_velocity) * (blend / dt)
        self._smooth_velocity = self._smooth_velocity + change * dt
        self.own_acceleration = change

    def _watch_heading(self, dt: float, arms: Vector, roll: Vector, leaving: Sequence[bool]) -> None:
        """Learn the gyro's bias about the vertical from the line between two firmly standing feet."""
        firm = [leg for leg in range(4) if self._standing_for[leg] > FIRM and not leaving[leg]]
        pair, arm, rolls = (-1, -1), _NOWHERE, _NOWHERE
        if len(firm) == 2 and abs(self.attitude.turn[2]) < SLOW_TURN:
            pair = (firm[0], firm[1])
            arm, rolls = _triple(arms[pair[1]] - arms[pair[0]]), _triple(roll[pair[1]] - roll[pair[0]])
        told = self._line.update(dt, pair, arm, rolls)
        if told is not None:
            self.attitude.bias.turning(*told)


def _triple(values: Vector) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)


def _observation(standing: tuple[int, ...]) -> tuple[Vector, NDArray[np.intp], Vector]:
    """For a set of standing feet: the observation matrix (places, then speeds), the feet, and the variances of both."""
    count = len(standing)
    rows = np.zeros((2 * count, 6))
    for row, leg in enumerate(standing):
        rows[row, 0], rows[row, leg + 2] = -1.0, 1.0
        rows[count + row, 1] = 1.0
    return rows, np.array(standing), np.repeat((PLACE_NOISE**2, SPEED_NOISE**2), count)


_OBSERVE = {
    standing: _observation(standing)
    for mask in range(1, 16)
    for standing in [tuple(leg for leg in range(4) if mask >> leg & 1)]
}
