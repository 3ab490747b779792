"""Where the robot is and how fast it moves, from IMU, encoders and foot contacts alone (the `odom` frame).

Attitude comes from `AttitudeFilter`. Position and velocity come from a Kalman filter over body position, body velocity and the
four foot points: predicted with the accelerometer, corrected by what standing feet say (robot-domain section 6, with the
rolling of the ball feet). The three axes share their model and noise, so one 6 x 6 covariance serves all three.

All noises are densities, so that what is believed after a second does not depend on the rate of the samples.

Height over flat ground cannot be observed: a prior pulls the standing feet to height zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, exp

from robot.estimation.attitude import AttitudeFilter
from robot.estimation.gyro_bias import FootLine
from robot.geometry.vectors import Rows, Triple, Vector, to_body, to_ground
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LEVEL, Limbs, foot_velocities, limbs
from robot.model.parameters import FOOT_RADIUS, GRAVITY

__all__ = ["Estimator"]

PLACE_NOISE = 2.83e-4
"""Noise density of a foot's place as the encoders tell it, m/sqrt(Hz): at 200 Hz a standard deviation of 4 mm."""
LANDING_NOISE = 0.0223
"""Standard deviation (m) of a foot's place, against the body, at the moment when it lands."""
SPEED_NOISE = 4.24e-3
"""Noise density of the body's velocity as one standing foot tells it, m/s/sqrt(Hz): at 200 Hz a standard deviation of 0.06 m/s."""
ACCEL_NOISE = 0.0424
"""Noise density of the accelerometer in a walking body, m/s2/sqrt(Hz): at 200 Hz a standard deviation of 0.6 m/s2."""
SLIDE_NOISE = 0.0283
"""How far a standing foot may creep, m/sqrt(s) (standard deviation of a random walk): 2 mm in 5 ms."""
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
SLIDE = 0.2
"""The same for a foot that stands firmly: it slides (m/s)."""
CERTAIN = 0.017
"""Seconds after which that is certain: a push makes feet slide for a moment, too."""
FLOOR_TIME = 0.5
"""Time constant (s) of the prior that standing feet are at height zero."""
OWN_ACCEL_TIME = 0.15
"""Time constant (s) of the robot's own acceleration, told from its velocity, that the attitude filter subtracts."""

_SURE, _UNSURE = 1e-6, 1e-4
"""Variances at the start: of the position, which defines odom (m2: 1 mm), and of all else (m2, m2/s2: 1 cm, 1 cm/s); chosen."""


class Estimator:
    """The state of the body at the latest sample. `update` once per control step.

    The odom frame starts under the robot at the first sample, x forward. Until `update` has been called once, everything is zero.
    """

    def __init__(self) -> None:
        self.attitude = AttitudeFilter()
        self.rotation: Rows = self.attitude.rotation
        """Body to odom, three rows."""
        self.position: Triple = _NOWHERE
        """Body origin in odom, m; z is the height above the standing feet's soles."""
        self.velocity: Triple = _NOWHERE
        """Body origin in odom axes, m/s."""
        self.contact: tuple[bool, ...] = (False,) * 4
        self.legs: Limbs = limbs((0.0,) * 12, LEVEL)
        self.contacts: list[Triple] = [_NOWHERE] * 4
        """Where each foot's centre was when it last stood, odom, m."""
        self.slipping = [False] * 4
        """Feet that stand and slide."""
        self.own_acceleration: Triple = _NOWHERE
        self._state = [[0.0, 0.0, 0.0] for _ in range(6)]
        """Position, velocity, and where the four feet are."""
        self._spread = [[(_SURE if i == 0 else _UNSURE) if i == j else 0.0 for j in range(6)] for i in range(6)]
        self._standing_for = [0.0] * 4
        self._sliding_for = [0.0] * 4
        self._smooth_velocity: Triple = _NOWHERE
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
        own = to_body(self.rotation, self.own_acceleration)
        self.attitude.update(dt, gyro, accel, own, still)
        up = self.attitude.up
        self.rotation = rotation = self.attitude.rotation
        self.legs = limbs(angles, up)
        moving, rolling = foot_velocities(self.legs, angles, speeds, self.attitude.turn, up)
        self.contact = tuple(joints.contact.tolist())
        arms = [to_ground(rotation, foot) for foot in self.legs.feet]
        if not self._started:
            self._begin(arms)
        roll = [to_ground(rotation, speed) for speed in rolling]
        x, y, z = to_ground(rotation, accel)
        self._predict(dt, (x, y, z - GRAVITY), roll)
        told: list[Triple] = []
        for (rx, ry, rz), speed in zip(roll, moving, strict=True):
            mx, my, mz = to_ground(rotation, speed)
            told.append((rx - mx, ry - my, rz - mz))
        self._correct(dt, arms, told, leaving)
        if still and not any(self.contact):
            self._rest()
        self._pin_height(dt)
        self._watch_acceleration(dt, told)
        self._watch_heading(dt, arms, roll, leaving)

    @property
    def deviation(self) -> tuple[float, float]:
        """Standard deviations of position (m) and velocity (m/s) as the filter believes them, the same on every axis."""
        return self._spread[0][0] ** 0.5, self._spread[1][1] ** 0.5

    def _begin(self, arms: list[Triple]) -> None:
        self._started = True
        height = -sum(z for _, _, z in arms) / 4
        self._state[0][2] = height
        for foot, (x, y, z) in enumerate(arms, 2):
            self._state[foot] = [x, y, z + height]
        self.contacts = [(x, y, z + height) for x, y, z in arms]

    def _predict(self, dt: float, acceleration: Triple, roll: list[Triple]) -> None:
        state, spread = self._state, self._spread
        place, speed = state[0], state[1]
        for axis, push in enumerate(acceleration):
            place[axis] += speed[axis] * dt + push * (0.5 * dt * dt)
            speed[axis] += push * dt
        for foot, (x, y, z) in zip(state[2:], roll, strict=True):
            foot[0] += x * dt
            foot[1] += y * dt
            foot[2] += z * dt
        spread[0] = [a + dt * b for a, b in zip(spread[0], spread[1], strict=True)]
        for row in spread:
            row[0] += dt * row[1]
        spread[1][1] += ACCEL_NOISE**2 * dt
        for index in range(2, 6):
            spread[index][index] += SLIDE_NOISE**2 * dt

    def _correct(self, dt: float, arms: list[Triple], told: list[Triple], leaving: Sequence[bool]) -> None:
        """Take in what the standing feet say, one at a time: their noises are independent, so the order does not matter."""
        state = self._state
        standing: list[tuple[int, float]] = []
        velocity = tuple(state[1])
        for leg in range(4):
            if not self.contact[leg]:
                self._standing_for[leg] = self._sliding_for[leg] = 0.0
                self.slipping[leg] = False
                continue
            if self._standing_for[leg] == 0.0:
                self._land(leg, arms[leg])
            self._standing_for[leg] += dt
            apart = dist(told[leg], velocity)
            slides = apart > SLIDE and self._standing_for[leg] > FIRM and not leaving[leg]
            self._sliding_for[leg] = self._sliding_for[leg] + dt if slides else 0.0
            self.slipping[leg] = self._sliding_for[leg] > CERTAIN
            slip = self.slipping[leg] or apart > SLIP
            landing = self._standing_for[leg] < SETTLING
            standing.append((leg, DOUBT if slip or landing or leaving[leg] else 1.0))
        for leg, doubt in standing:
            foot = leg + 2
            spread = self._spread
            pull = [row[foot] - row[0] for row in spread]
            (x, y, z), (px, py, pz), (fx, fy, fz) = arms[leg], state[0], state[foot]
            self._learn(pull, pull[foot] - pull[0] + doubt * PLACE_NOISE**2 / dt, x + px - fx, y + py - fy, z + pz - fz)
            spread = self._spread
            (x, y, z), (vx, vy, vz) = told[leg], state[1]
            pull = [row[1] for row in spread]
            self._learn(pull, pull[1] + doubt * SPEED_NOISE**2 / dt, x - vx, y - vy, z - vz)
        if standing:
            self._tidy()
        for leg in range(4):
            x, y, z = state[leg + 2]
            if self.contact[leg]:
                self.contacts[leg] = (x, y, z)
            else:
                state[leg + 2] = [a + b for a, b in zip(state[0], arms[leg], strict=True)]
        self._publish()

    def _learn(self, pull: list[float], variance: float, x: float, y: float, z: float) -> None:
        """One measurement: how each state goes with it (covariances), its variance, and by how much it differs from what was thought."""
        share = 1.0 / variance
        x, y, z = x * share, y * share, z * share
        spread = self._spread
        for index, weight in enumerate(pull):
            row = self._state[index]
            row[0] += weight * x
            row[1] += weight * y
            row[2] += weight * z
            part = weight * share
            spread[index] = [a - part * b for a, b in zip(spread[index], pull, strict=True)]

    def _tidy(self) -> None:
        """Rounding makes the covariance unsymmetric, and what is unsymmetric grows."""
        spread = self._spread
        for i in range(1, 6):
            row = spread[i]
            for j in range(i):
                row[j] = spread[j][i] = 0.5 * (row[j] + spread[j][i])

    def _publish(self) -> None:
        (px, py, pz), (vx, vy, vz) = self._state[0], self._state[1]
        self.position, self.velocity = (px, py, pz), (vx, vy, vz)

    def _land(self, leg: int, arm: Triple) -> None:
        """A foot touches down: its place is where the leg says, as uncertain as the body plus the encoders."""
        foot, spread = leg + 2, self._spread
        self._state[foot] = [a + b for a, b in zip(self._state[0], arm, strict=True)]
        spread[foot] = spread[0].copy()
        for row in spread:
            row[foot] = row[0]
        spread[foot][foot] = spread[0][0] + LANDING_NOISE**2

    def _pin_height(self, dt: float) -> None:
        """Shift body and feet together, so that nothing the filter observes changes."""
        state = self._state
        heights = [state[leg + 2][2] - FOOT_RADIUS for leg in range(4) if self.contact[leg]]
        if not heights:
            return
        shift = sum(heights) / len(heights) * min(1.0, dt / FLOOR_TIME)
        state[0][2] -= shift
        for foot in state[2:]:
            foot[2] -= shift
        self.contacts = [(x, y, z - shift) for x, y, z in self.contacts]

    def _rest(self) -> None:
        """The robot lies on its skid: no foot says so, but it does not move."""
        self._state[1] = [0.0, 0.0, 0.0]
        for row in self._spread:
            row[1] = 0.0
        self._spread[1] = [0.0, _UNSURE, 0.0, 0.0, 0.0, 0.0]
        self.velocity = _NOWHERE

    def _watch_acceleration(self, dt: float, told: list[Triple]) -> None:
        """From what standing feet say alone: the filtered velocity contains the accelerometer and would agree with it."""
        count = sum(self.contact)
        if count == 0:
            fade = 1.0 - dt / OWN_ACCEL_TIME
            x, y, z = self.own_acceleration
            self.own_acceleration = (x * fade, y * fade, z * fade)
            return
        blend = (1.0 - exp(-dt / OWN_ACCEL_TIME)) / dt
        x = y = z = 0.0
        for stands, (tx, ty, tz) in zip(self.contact, told, strict=True):
            if stands:
                x, y, z = x + tx, y + ty, z + tz
        sx, sy, sz = self._smooth_velocity
        x, y, z = (x / count - sx) * blend, (y / count - sy) * blend, (z / count - sz) * blend
        self.own_acceleration = (x, y, z)
        self._smooth_velocity = (sx + x * dt, sy + y * dt, sz + z * dt)

    def _watch_heading(self, dt: float, arms: list[Triple], roll: list[Triple], leaving: Sequence[bool]) -> None:
        """Learn the gyro's bias about the vertical from the line between two firmly standing feet."""
        firm = [leg for leg in range(4) if self._standing_for[leg] > FIRM and not leaving[leg]]
        pair, arm, rolls = (-1, -1), _NOWHERE, _NOWHERE
        if len(firm) == 2 and abs(self.attitude.turn[2]) < SLOW_TURN:
            pair = (firm[0], firm[1])
            arm, rolls = _between(arms, pair), _between(roll, pair)
        told = self._line.update(dt, pair, arm, rolls)
        if told is not None:
            self.attitude.bias.turning(*told)


def _triple(values: Vector) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)


def _between(vectors: list[Triple], pair: tuple[int, int]) -> Triple:
    (ax, ay, az), (bx, by, bz) = vectors[pair[0]], vectors[pair[1]]
    return (bx - ax, by - ay, bz - az)
