"""Where the robot is and how fast it moves, from IMU, encoders and foot contacts alone (the `odom` frame).

Attitude comes from `AttitudeFilter`. Position and velocity come from a linear Kalman filter (after Bloesch et al., 2012). Each axis has the
state x = [p, v, f1, f2, f3, f4]: body position (m), body velocity (m/s) and the four foot centres (m). Inputs are the acceleration
a = R accel - g and the velocities ri with which the ball feet roll:

    prediction    p += v dt + a dt^2 / 2       v += a dt       fi += ri dt
                  P <- F P F' + Q              F = 1 + dt e_p e_v'       Q = dt diag(0, ACCEL_NOISE^2, SLIDE_NOISE^2, ...)
    correction    z = R pi                       H x = fi - p      variance PLACE_NOISE^2 / dt
                  z = ri - R (J qd + w x pi)     H x = v           variance SPEED_NOISE^2 / dt        for each standing foot

The axes share model and noise, hence one covariance P (6 x 6) for all three. All noises are densities, so that the covariance after a
second does not depend on the rate of the samples.

Height over flat ground cannot be observed: standing feet are shifted to height zero, outside of the filter.
Symbols and sources: docs/concepts/control.md#leg-odometry.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, exp

from robot.estimation.attitude import AttitudeFilter
from robot.estimation.gyro_bias import FootLine
from robot.geometry.vectors import Rows, Triple, Vector, to_body, to_ground
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LEVEL, LegState, foot_velocities, leg_state
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, RobotModel

PLACE_NOISE = 2.83e-4
"""Noise density of a foot's position against the body by the encoders, m/sqrt(Hz): at 200 Hz a standard deviation of 4 mm."""
LANDING_NOISE = 0.0223
"""Standard deviation of a foot's position against the body at touch-down, m."""
SPEED_NOISE = 4.24e-3
"""Noise density of the body's velocity by one standing foot, m/s/sqrt(Hz): at 200 Hz a standard deviation of 0.06 m/s."""
ACCEL_NOISE = 0.0424
"""Noise density of the accelerometer in a walking body, m/s2/sqrt(Hz): at 200 Hz a standard deviation of 0.6 m/s2."""
SLIDE_NOISE = 0.0283
"""Density of a standing foot's random walk, m/sqrt(s): 2 mm in 5 ms."""
DOUBT = 31.0
"""Factor on the measurement variance R (5.6 on sigma) of a foot that has just landed, is about to lift or slips: its contact point moves."""
SETTLING = 0.02
"""Time for which a foot counts as just landed, s."""
FIRM = 0.03
"""Time after touch-down from which a foot stands firmly enough for the slide test and the foot line, s."""
SLOW_TURN = 0.3
"""Turning faster than this (rad/s) the feet twist on the ground, and the foot line is no measurement of the gyro's bias."""
_NOWHERE: Triple = (0.0, 0.0, 0.0)
SLIP = 0.35
"""Innovation of the velocity (norm, m/s) above which a standing foot slips, and is weighted by `DOUBT`."""
SLIDE = 0.2
"""The same for a foot that stands firmly, m/s: it slides."""
CERTAIN = 0.017
"""Time for which it must slide before it is reported as slipping, s: a push makes feet slide for a moment, too."""
BLIND_ACCEL_NOISE = 0.14
"""Instead of `ACCEL_NOISE` without an accelerometer, m/s2/sqrt(Hz): what is not known of the body's acceleration; the feet tell its speed."""
BLIND_SLIP, BLIND_SLIDE = 1.5, 0.6
"""Instead of `SLIP` and `SLIDE` without an accelerometer, m/s: the feet are then not called liars by a speed that they have told themselves."""
FLOOR_TIME = 0.5
"""Time constant with which standing feet are shifted to height zero, s."""
OWN_ACCEL_TIME = 0.15
"""Time constant of the low-pass before the feet's velocity is differentiated to the robot's own acceleration, s."""

_SURE, _UNSURE = 1e-6, 1e-4
"""Variances at the start: of the position, which defines odom (m2: 1 mm), and of all else (m2, m2/s2: 1 cm, 1 cm/s); chosen."""


class Estimator:
    """The state of the body at the latest sample. `update` once per control step.

    The odom frame starts under the robot at the first sample, x forward. Until `update` has been called once, everything is zero.
    """

    def __init__(self, model: RobotModel = SPOT) -> None:
        self.attitude = AttitudeFilter()
        self.rotation: Rows = self.attitude.rotation
        """Body to odom, three rows."""
        self.position: Triple = _NOWHERE
        """Body origin in odom, m; z is the height above the standing feet's soles."""
        self.velocity: Triple = _NOWHERE
        """Body origin in odom axes, m/s."""
        self.contact: tuple[bool, ...] = (False,) * 4
        self.legs: LegState = leg_state((0.0,) * 12, LEVEL, model)
        self.contacts: list[Triple] = [_NOWHERE] * 4
        """Where each foot's centre was when it last stood, odom, m."""
        self.slipping = [False] * 4
        """Feet that stand and slide."""
        self.over_ground = [0.0] * 4
        """How fast each foot moves over the ground, m/s: of one that stands, what it slides."""
        self.own_acceleration: Triple = _NOWHERE
        self.firm: dict[int, tuple[Triple, Triple]] = {}
        """Of each leg whose foot stands firmly: where that is from the body (m), and the velocity of the body that it tells (m/s); odom axes."""
        self._state = [[0.0, 0.0, 0.0] for _ in range(6)]
        """Mean: rows p, v, f1 to f4, columns x, y, z of odom."""
        self._covariance = [[(_SURE if i == 0 else _UNSURE) if i == j else 0.0 for j in range(6)] for i in range(6)]
        """Covariance P of that state, the same for every axis."""
        self._standing_for = [0.0] * 4
        self._sliding_for = [0.0] * 4
        self._smooth_velocity: Triple = _NOWHERE
        """Low-passed mean velocity that the standing feet show, odom axes, m/s."""
        self._line = FootLine()
        self._started = self._blind = False

    def update(
        self,
        dt: float,
        imu: ImuSample,
        joints: JointSample,
        leaving: Sequence[bool] = (False,) * 4,
        still: bool = False,
        blind: bool = False,
    ) -> None:
        """Take in one sample, `dt` seconds after the last.

        `leaving` marks feet about to lift (their variance is raised); `still` says that the robot is meant to stand at rest; `blind` that
        `imu` was not measured: the velocity then follows the feet.
        """
        gyro, accel = _triple(imu.gyro), _triple(imu.accel)
        angles, speeds = joints.position.tolist(), joints.velocity.tolist()
        if not self._started:
            self.attitude.level(accel)
        own = to_body(self.rotation, self.own_acceleration)
        self.attitude.update(dt, gyro, accel, own, still)
        up = self.attitude.up
        self.rotation = rotation = self.attitude.rotation
        self.legs = leg_state(angles, up, self.legs.model)
        moving, rolling = foot_velocities(self.legs, angles, speeds, self.attitude.turn, up)
        self.contact = tuple(joints.contact.tolist())
        arms = [to_ground(rotation, foot) for foot in self.legs.feet]
        if not self._started:
            self._begin(arms)
        roll = [to_ground(rotation, speed) for speed in rolling]
        x, y, z = to_ground(rotation, accel)
        self._blind = blind
        self._predict(dt, (x, y, z - GRAVITY), roll)
        measured_velocity: list[Triple] = []
        for (rx, ry, rz), speed in zip(roll, moving, strict=True):
            mx, my, mz = to_ground(rotation, speed)
            measured_velocity.append((rx - mx, ry - my, rz - mz))
        self.over_ground = [dist(speed, self._state[1]) for speed in measured_velocity]
        self._correct(dt, arms, measured_velocity, leaving)
        if still and not any(self.contact):
            self._rest()
        self._pin_height(dt)
        self._publish()
        self._watch_acceleration(dt, measured_velocity)
        firm = [leg for leg in range(4) if self._standing_for[leg] > FIRM and not leaving[leg]]
        self.firm = {leg: (arms[leg], measured_velocity[leg]) for leg in firm}
        self._watch_heading(dt, arms, roll, firm)

    def moving(self, velocity: Triple, deviation: float) -> None:
        """Believe that the body moves at `velocity` (odom axes, m/s), as far as a standard deviation of so many m/s says."""
        self._state[1] = list(velocity)
        self._smooth_velocity = velocity
        self._covariance[1][1] = deviation * deviation
        self._publish()

    def foot(self, leg: int) -> Triple:
        """Where a foot's centre is, odom, m: of one that stands by the filter, of one in the air by its joints."""
        x, y, z = self._state[leg + 2]
        return (x, y, z)

    @property
    def deviation(self) -> tuple[float, float]:
        """Standard deviations of position (m) and velocity (m/s) as the filter believes them, the same on every axis."""
        return self._covariance[0][0] ** 0.5, self._covariance[1][1] ** 0.5

    def _begin(self, arms: list[Triple]) -> None:
        self._started = True
        height = -sum(z for _, _, z in arms) / 4
        self._state[0][2] = height
        for foot, (x, y, z) in enumerate(arms, 2):
            self._state[foot] = [x, y, z + height]
        self.contacts = [(x, y, z + height) for x, y, z in arms]

    def _predict(self, dt: float, acceleration: Triple, roll: list[Triple]) -> None:
        """Prediction over `dt` seconds: mean, and P <- F P F' + Q."""
        state, covariance = self._state, self._covariance
        place, speed = state[0], state[1]
        for axis, push in enumerate(acceleration):
            place[axis] += speed[axis] * dt + push * (0.5 * dt * dt)
            speed[axis] += push * dt
        for foot, (x, y, z) in zip(state[2:], roll, strict=True):
            foot[0] += x * dt
            foot[1] += y * dt
            foot[2] += z * dt
        covariance[0] = [a + dt * b for a, b in zip(covariance[0], covariance[1], strict=True)]
        for row in covariance:
            row[0] += dt * row[1]
        covariance[1][1] += (BLIND_ACCEL_NOISE if self._blind else ACCEL_NOISE) ** 2 * dt
        for index in range(2, 6):
            covariance[index][index] += SLIDE_NOISE**2 * dt

    def _correct(self, dt: float, arms: list[Triple], measured_velocity: list[Triple], leaving: Sequence[bool]) -> None:
        """Correction by every standing foot, one after the other: their noises are independent, so the order does not matter."""
        state = self._state
        standing: list[tuple[int, float]] = []
        slip_from, slide_from = (BLIND_SLIP, BLIND_SLIDE) if self._blind else (SLIP, SLIDE)
        for leg in range(4):
            if not self.contact[leg]:
                self._standing_for[leg] = self._sliding_for[leg] = 0.0
                self.slipping[leg] = False
                continue
            if self._standing_for[leg] == 0.0:
                self._land(leg, arms[leg])
            self._standing_for[leg] += dt
            apart = self.over_ground[leg]
            slides = apart > slide_from and self._standing_for[leg] > FIRM and not leaving[leg]
            self._sliding_for[leg] = self._sliding_for[leg] + dt if slides else 0.0
            self.slipping[leg] = self._sliding_for[leg] > CERTAIN
            slip = self.slipping[leg] or apart > slip_from
            landing = self._standing_for[leg] < SETTLING
            standing.append((leg, DOUBT if slip or landing or leaving[leg] else 1.0))
        for leg, doubt in standing:
            foot = leg + 2
            covariance = self._covariance
            cross = [row[foot] - row[0] for row in covariance]
            (x, y, z), (px, py, pz), (fx, fy, fz) = arms[leg], state[0], state[foot]
            self._kalman_update(
                cross, cross[foot] - cross[0] + doubt * PLACE_NOISE**2 / dt, x + px - fx, y + py - fy, z + pz - fz
            )
            covariance = self._covariance
            (x, y, z), (vx, vy, vz) = measured_velocity[leg], state[1]
            cross = [row[1] for row in covariance]
            self._kalman_update(cross, cross[1] + doubt * SPEED_NOISE**2 / dt, x - vx, y - vy, z - vz)
        if standing:
            self._symmetrize()
        for leg in range(4):
            x, y, z = state[leg + 2]
            if self.contact[leg]:
                self.contacts[leg] = (x, y, z)
            else:
                state[leg + 2] = [a + b for a, b in zip(state[0], arms[leg], strict=True)]

    def _kalman_update(self, cross: list[float], variance: float, x: float, y: float, z: float) -> None:
        """Scalar Kalman update for each axis: `cross` = P H', `variance` = H P H' + R, (x, y, z) = innovation."""
        share = 1.0 / variance
        x, y, z = x * share, y * share, z * share
        covariance = self._covariance
        for index, weight in enumerate(cross):
            row = self._state[index]
            row[0] += weight * x
            row[1] += weight * y
            row[2] += weight * z
            part = weight * share
            covariance[index] = [a - part * b for a, b in zip(covariance[index], cross, strict=True)]

    def _symmetrize(self) -> None:
        """Make the covariance symmetric again: rounding makes it unsymmetric, and that grows."""
        covariance = self._covariance
        for i in range(1, 6):
            row = covariance[i]
            for j in range(i):
                row[j] = covariance[j][i] = 0.5 * (row[j] + covariance[j][i])

    def _land(self, leg: int, arm: Triple) -> None:
        """A foot touches down: its position is where the leg has it, its covariance that of the body's position plus `LANDING_NOISE`."""
        foot, covariance = leg + 2, self._covariance
        self._state[foot] = [a + b for a, b in zip(self._state[0], arm, strict=True)]
        covariance[foot] = covariance[0].copy()
        for row in covariance:
            row[foot] = row[0]
        covariance[foot][foot] = covariance[0][0] + LANDING_NOISE**2

    def _pin_height(self, dt: float) -> None:
        """Shift body and feet together towards height zero of the soles: no innovation of the filter changes by it."""
        state, radius = self._state, self.legs.model.foot_radius
        heights = [state[leg + 2][2] - radius for leg in range(4) if self.contact[leg]]
        if not heights:
            return
        shift = sum(heights) / len(heights) * min(1.0, dt / FLOOR_TIME)
        state[0][2] -= shift
        for foot in state[2:]:
            foot[2] -= shift
        self.contacts = [(x, y, z - shift) for x, y, z in self.contacts]

    def _rest(self) -> None:
        """The robot lies on its skid, without a foot on the ground: its velocity is zero, and uncorrelated."""
        self._state[1] = [0.0, 0.0, 0.0]
        for row in self._covariance:
            row[1] = 0.0
        self._covariance[1] = [0.0, _UNSURE, 0.0, 0.0, 0.0, 0.0]

    def _publish(self) -> None:
        (px, py, pz), (vx, vy, vz) = self._state[0], self._state[1]
        self.position, self.velocity = (px, py, pz), (vx, vy, vz)

    def _watch_acceleration(self, dt: float, measured_velocity: list[Triple]) -> None:
        """Own acceleration from the velocity by the feet alone: the filtered one contains the accelerometer and would agree with it.

        While no foot stands (the flight of a bound or a pronk), the low-pass goes on with the last velocity that the feet have shown: a body in
        flight keeps its horizontal velocity, and its vertical one does not tilt the horizon.
        """
        keep = exp(-dt / OWN_ACCEL_TIME)
        count = sum(self.contact)
        sx, sy, sz = self._smooth_velocity
        if count == 0:
            x, y, z = self.own_acceleration
            x, y, z = x * keep, y * keep, z * keep
        else:
            blend = (1.0 - keep) / dt
            x = y = z = 0.0
            for stands, (fx, fy, fz) in zip(self.contact, measured_velocity, strict=True):
                if stands:
                    x, y, z = x + fx, y + fy, z + fz
            x, y, z = (x / count - sx) * blend, (y / count - sy) * blend, (z / count - sz) * blend
        self.own_acceleration = (x, y, z)
        self._smooth_velocity = (sx + x * dt, sy + y * dt, sz + z * dt)

    def _watch_heading(self, dt: float, arms: list[Triple], roll: list[Triple], firm: Sequence[int]) -> None:
        """Estimate the gyro's bias about the vertical from the line between two firmly standing feet."""
        pair, arm, rolls = (-1, -1), _NOWHERE, _NOWHERE
        if not self.attitude.pull.active and len(firm) == 2 and abs(self.attitude.turn[2]) < SLOW_TURN:
            pair = (firm[0], firm[1])
            arm, rolls = _between(arms, pair), _between(roll, pair)
        slope = self._line.update(dt, pair, arm, rolls)
        if slope is not None:
            self.attitude.bias.turning(*slope)


def _triple(values: Vector) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)


def _between(vectors: list[Triple], pair: tuple[int, int]) -> Triple:
    (ax, ay, az), (bx, by, bz) = vectors[pair[0]], vectors[pair[1]]
    return (bx - ax, by - ay, bz - az)
