"""The leg odometry against a Kalman filter in full matrices, and against the truth of a body that moves over rolling feet."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.estimation.leg_odometry import (
    ACCEL_NOISE,
    CERTAIN,
    DOUBT,
    FIRM,
    FLOOR_TIME,
    LANDING_NOISE,
    PLACE_NOISE,
    SETTLING,
    SLIDE,
    SLIDE_NOISE,
    SLIP,
    SPEED_NOISE,
    Estimator,
)
from robot.geometry.vectors import Floats
from robot.hardware.body import ImuSample, JointSample
from robot.model.parameters import FOOT_RADIUS, GRAVITY
from tests.robot.estimation.stance import ALL, HEIGHT, Swaying, at_rest, joints, leg, standing

NONE = (False,) * 4
PACE = np.array((0.3, -0.1, 0.05))
"""Amplitudes of the sway's velocity, m/s."""
TURN = np.array((0.15, -0.2, 0.25))
"""And of its turning, rad/s."""


def swayed(time: float) -> tuple[Floats, Floats, Floats]:
    """Velocity, acceleration (odom) and turning (body) of a body that sways for 0.4 s and comes back to rest."""
    phase = 2 * np.pi * time / 0.4
    return PACE * (1 - np.cos(phase)), PACE * np.sin(phase) * 2 * np.pi / 0.4, TURN * np.sin(phase)


class Matrices:
    """The filter of docs/concepts/control.md as a textbook writes it: F, Q, H, R as matrices, the three axes as columns."""

    def __init__(self, arms: Floats) -> None:
        self.x = np.zeros((6, 3))
        self.x[2:] = arms
        self.x[0, 2] = -arms[:, 2].mean()
        self.x[2:, 2] += self.x[0, 2]
        self.p = np.diag((1e-6, *(5 * (1e-4,))))
        self.standing_for, self.sliding_for = np.zeros(4), np.zeros(4)

    def step(
        self, dt: float, force: Floats, arms: Floats, rolling: Floats, moving: Floats, stands: Sequence[bool], leaving: Sequence[bool]
    ) -> None:  # fmt: skip
        """All vectors in odom axes: specific force, feet from the body, what they roll and what they move against the body."""
        acceleration = force - np.array((0.0, 0.0, GRAVITY))
        f = np.eye(6)
        f[0, 1] = dt
        u = np.vstack((0.5 * acceleration * dt**2, acceleration * dt, rolling * dt))
        self.x = f @ self.x + u
        self.p = f @ self.p @ f.T + dt * np.diag((0.0, ACCEL_NOISE**2, *(4 * (SLIDE_NOISE**2,))))
        velocity, doubts = self.x[1].copy(), np.ones(4)
        for foot in np.flatnonzero(stands):
            if self.standing_for[foot] == 0.0:
                self.x[foot + 2] = self.x[0] + arms[foot]
                self.p[foot + 2], self.p[:, foot + 2] = self.p[0], self.p[:, 0]
                self.p[foot + 2, foot + 2] = self.p[0, 0] + LANDING_NOISE**2
            self.standing_for[foot] += dt
            off = np.linalg.norm(rolling[foot] - moving[foot] - velocity)
            firm = self.standing_for[foot] > FIRM and not leaving[foot]
            self.sliding_for[foot] = self.sliding_for[foot] + dt if off > SLIDE and firm else 0.0
            landing = self.standing_for[foot] < SETTLING
            if off > SLIP or self.sliding_for[foot] > CERTAIN or landing or leaving[foot]:
                doubts[foot] = DOUBT
        for foot in np.flatnonzero(stands):
            place, speed = np.zeros((1, 6)), np.zeros((1, 6))
            place[0, foot + 2], place[0, 0], speed[0, 1] = 1.0, -1.0, 1.0
            self._correct(place, arms[foot], doubts[foot] * PLACE_NOISE**2 / dt)
            self._correct(speed, rolling[foot] - moving[foot], doubts[foot] * SPEED_NOISE**2 / dt)
        for foot in np.flatnonzero(~np.array(stands)):
            self.x[foot + 2] = self.x[0] + arms[foot]
            self.standing_for[foot] = self.sliding_for[foot] = 0.0
        if any(stands):
            shift = (self.x[2:][np.array(stands), 2] - FOOT_RADIUS).mean() * min(1.0, dt / FLOOR_TIME)
            self.x[[0, 2, 3, 4, 5], 2] -= shift

    def _correct(self, h: Floats, z: Floats, r: float) -> None:
        s = h @ self.p @ h.T + r
        k = self.p @ h.T @ np.linalg.inv(s)
        self.x = self.x + k @ (z[None, :] - h @ self.x)
        joseph = np.eye(6) - k @ h
        self.p = joseph @ self.p @ joseph.T + k @ k.T * r


@pytest.mark.parametrize(("hz", "seed"), [(100, 1), (200, 2), (500, 3)])
def test_every_estimate_is_that_of_a_kalman_filter_in_full_matrices(hz: int, seed: int) -> None:
    """Noisy samples, feet that lift, land, leave and slip at random."""
    dt, random = 1.0 / hz, np.random.default_rng(seed)
    truth, estimate, matrices = Swaying(), Estimator(), None
    stands, slips = np.array(ALL), np.zeros(12)
    for step in range(1, round(0.4 * hz) + 1):
        velocity, acceleration, turn = swayed(step * dt)
        truth.move(dt, velocity, turn)
        stands = stands ^ (random.random(4) < 4.0 * dt)
        leaving = (random.random(4) < 0.1).tolist()
        if random.random() < 3.0 * dt:
            slips = random.normal(0.0, 1.5, 12) * (random.random(12) < 0.3)
        imu = truth.imu(acceleration + random.normal(0.0, 0.5, 3))
        angles = truth.angles + random.normal(0.0, 5e-4, 12)
        speeds = truth.speeds + slips + random.normal(0.0, 0.05, 12)
        estimate.update(dt, imu, joints(angles, speeds, stands.tolist()), leaving)

        turned, rates = np.array(estimate.rotation), np.array(estimate.attitude.turn)
        legs = [leg(number, angles) for number in range(4)]
        ball = FOOT_RADIUS * turned[2]
        arms = np.array([turned @ foot for foot, _, _ in legs])
        parts = speeds.reshape(4, 3)
        rolling = np.array(
            [turned @ np.cross(rates + axes @ part, ball) for (_, _, axes), part in zip(legs, parts, strict=True)]
        )
        moving = np.array(
            [turned @ (jac @ part + np.cross(rates, foot)) for (foot, jac, _), part in zip(legs, parts, strict=True)]
        )
        matrices = matrices or Matrices(arms)
        matrices.step(dt, turned @ imu.accel, arms, rolling, moving, stands.tolist(), leaving)
        assert estimate.position == pytest.approx(tuple(matrices.x[0]), abs=1e-9)
        assert estimate.velocity == pytest.approx(tuple(matrices.x[1]), abs=1e-9)
        assert estimate.deviation == pytest.approx(tuple(np.sqrt(np.diag(matrices.p)[:2])), rel=1e-7)
        assert estimate.slipping == (matrices.sliding_for > CERTAIN).tolist()
        for foot in np.flatnonzero(stands):
            assert estimate.contacts[foot] == pytest.approx(tuple(matrices.x[2 + foot]), abs=1e-9)


@cache
def followed(hz: int) -> tuple[Estimator, Swaying]:
    truth, estimate, dt = Swaying(), Estimator(), 1.0 / hz
    for step in range(1, round(0.4 * hz) + 1):
        velocity, acceleration, turn = swayed(step * dt)
        truth.move(dt, velocity, turn)
        estimate.update(dt, truth.imu(acceleration), joints(truth.angles, truth.speeds))
    return estimate, truth


def test_a_body_that_sways_over_rolling_feet_is_followed_to_a_few_millimetres() -> None:
    estimate, truth = followed(500)
    assert truth.position[:2] == pytest.approx(np.array((0.12, -0.04)), abs=1e-3), "it has really gone somewhere"
    assert estimate.position[:2] == pytest.approx(truth.position[:2], abs=2e-3)
    assert estimate.velocity == pytest.approx(truth.velocity, abs=0.01)
    assert (Rotation.from_matrix(np.array(estimate.rotation)).inv() * truth.rotation).magnitude() < 5e-3


@pytest.mark.parametrize("hz", [100, 200, 500])
def test_at_any_rate_it_is_off_by_less_than_the_way_between_two_samples(hz: int) -> None:
    estimate, truth = followed(hz)
    fine, _ = followed(500)
    way = 0.6 / hz
    assert estimate.position[:2] == pytest.approx(truth.position[:2], abs=way)
    assert estimate.position[2] == pytest.approx(fine.position[2], abs=way)
    assert estimate.velocity == pytest.approx(fine.velocity, abs=0.02)
    assert estimate.deviation == pytest.approx(fine.deviation, rel=0.05), "as a covariance of densities must"


MIRROR = np.array((1.0, -1.0, 1.0))
"""Of a vector; turning is mirrored the other way about."""


def mirrored(sample: JointSample) -> JointSample:
    """Left legs for right ones, hips turned the other way."""
    order, signs = np.array((3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8)), np.tile((-1.0, 1.0, 1.0), 4)
    contact = sample.contact[[1, 0, 3, 2]]
    return JointSample(sample.position[order] * signs, sample.velocity[order] * signs, np.zeros(12), contact)


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 1000), stands=st.lists(st.booleans(), min_size=4, max_size=4))
def test_a_mirrored_robot_is_in_the_mirrored_place(seed: int, stands: list[bool]) -> None:
    random, here, there = np.random.default_rng(seed), Estimator(), Estimator()
    for step in range(12):
        angles = standing().position + random.normal(0.0, 0.02, 12)
        sample = joints(angles, random.normal(0.0, 0.5, 12), ALL if step < 4 else stands)
        gyro, accel = random.normal(0.0, 0.3, 3), np.array((0.0, 0.0, GRAVITY)) + random.normal(0.0, 1.0, 3)
        here.update(0.005, ImuSample(gyro, accel), sample)
        there.update(0.005, ImuSample(-gyro * MIRROR, accel * MIRROR), mirrored(sample))
    assert there.position == pytest.approx(np.array(here.position) * MIRROR, abs=1e-12)
    assert there.velocity == pytest.approx(np.array(here.velocity) * MIRROR, abs=1e-12)
    assert there.own_acceleration == pytest.approx(np.array(here.own_acceleration) * MIRROR, abs=1e-9)
    assert [there.slipping[foot] for foot in (1, 0, 3, 2)] == here.slipping


def test_before_the_first_sample_everything_is_zero_and_then_it_stands_over_its_feet() -> None:
    estimate = Estimator()
    assert (estimate.position, estimate.velocity, estimate.contact) == ((0.0,) * 3, (0.0,) * 3, NONE)
    for _ in range(500):
        estimate.update(0.01, at_rest(), standing())
    assert estimate.contact == ALL
    assert estimate.position == pytest.approx((0.0, 0.0, HEIGHT + FOOT_RADIUS), abs=1e-4)
    assert [z for _, _, z in estimate.contacts] == pytest.approx([FOOT_RADIUS] * 4, abs=1e-4)


def test_shifting_the_floor_to_height_zero_takes_half_a_second_and_moves_nothing_against_anything() -> None:
    estimate = Estimator()
    for _ in range(50):
        estimate.update(0.01, at_rest(), standing())
    sunk = HEIGHT + FOOT_RADIUS - estimate.position[2]
    assert sunk / FOOT_RADIUS == pytest.approx(np.exp(-1.0), rel=0.02)
    assert [estimate.position[2] - z for _, _, z in estimate.contacts] == pytest.approx([HEIGHT] * 4, abs=1e-9)
    assert estimate.velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def dragged(speed: float, seconds: float, leaving: bool = False) -> Estimator:
    """A robot at rest, one of whose feet (front right) moves forward at so many m/s for the last so many seconds."""
    estimate = Estimator()
    for _ in range(40):
        estimate.update(0.005, at_rest(), standing())
    sample = standing()
    _, jacobian, axes = leg(1, sample.position)
    rolled = np.cross(axes.T, (0.0, 0.0, FOOT_RADIUS)).T
    sample.velocity[3:6] = np.linalg.solve(jacobian - rolled, (speed, 0.0, 0.0))
    for _ in range(round(seconds / 0.005)):
        estimate.update(0.005, at_rest(), sample, (False, leaving, False, False))
    return estimate


def test_a_foot_that_is_dragged_is_reported_once_it_is_certain_and_no_other_is() -> None:
    assert dragged(0.3, 0.015).slipping == [False] * 4
    assert dragged(0.3, 0.020).slipping == [False, True, False, False]
    assert dragged(0.15, 0.2).slipping == [False] * 4, "slower than a slide"
    assert dragged(0.3, 0.1, leaving=True).slipping == [False] * 4, "a foot about to lift may move"


def test_a_dragged_foot_hardly_moves_the_body() -> None:
    fast, doubted = dragged(1.0, 0.1), abs(dragged(0.19, 0.1).velocity[0])
    assert abs(fast.velocity[0]) < 0.02
    assert abs(fast.velocity[0]) < doubted, "of a quarter of the speed, which nothing doubts"


def test_a_foot_in_the_air_is_carried_along_and_its_contact_stays_where_it_stood() -> None:
    estimate, lifted = Estimator(), standing(contact=(True, False, True, True))
    for _ in range(20):
        estimate.update(0.005, at_rest(), standing())
    before = estimate.contacts[1]
    lifted.position[4] += 0.3
    for _ in range(20):
        estimate.update(0.005, at_rest(), lifted)
    assert estimate.contacts[1][:2] == before[:2]
    landed = standing()
    landed.position[4] += 0.3
    estimate.update(0.005, at_rest(), landed)
    foot = leg(1, landed.position)[0]
    assert estimate.contacts[1] == pytest.approx(np.array(estimate.position) + foot, abs=2e-3)


def test_a_robot_that_lies_still_without_a_foot_on_the_ground_has_no_velocity() -> None:
    estimate = Estimator()
    for _ in range(20):
        estimate.update(0.005, at_rest(), standing())
    fall = ImuSample(np.zeros(3), np.array((3.0, 0.0, GRAVITY)))
    for _ in range(20):
        estimate.update(0.005, fall, standing(contact=NONE))
    assert estimate.velocity[0] > 0.2, "without a foot it believes its accelerometer"
    estimate.update(0.005, at_rest(), standing(contact=NONE), still=True)
    assert estimate.velocity == (0.0, 0.0, 0.0)
    assert estimate.deviation[1] == pytest.approx(0.01)


def test_a_firm_pair_of_feet_that_seems_to_turn_shows_the_gyros_bias() -> None:
    estimate, wrong = Estimator(), ImuSample(np.array((0.0, 0.0, 2e-3)), at_rest().accel)
    for number in range(8):
        pair = (True, False, False, True) if number % 2 else (False, True, True, False)
        for _ in range(60):
            estimate.update(0.005, wrong, standing(contact=pair))
    assert estimate.attitude.bias.value[2] == pytest.approx(2e-3, abs=3e-4)
