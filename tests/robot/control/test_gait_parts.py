"""The parts of the gait: pattern, swing path, command shaping, legs' statics, force distribution, terrain plane, attitude."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.balance import FRICTION, distribute
from robot.control.command import CommandLimits, CommandShaper
from robot.control.drive import joint_speeds
from robot.control.gaits import GAITS, GaitClock
from robot.control.swing import swing_path
from robot.estimation.attitude import AttitudeFilter
from robot.estimation.terrain import TerrainPlane
from robot.model.kinematics import feet, inverse, leg_forward, leg_jacobian
from robot.model.legs import foot_velocities, leg_state, torques
from robot.model.parameters import GRAVITY, MASS, SIDES
from robot.model.stance import nominal_feet

finite = st.floats(-10.0, 10.0)


@pytest.mark.parametrize("name", sorted(GAITS))
def test_each_foot_stands_for_its_duty(name: str) -> None:
    clock = GaitClock(GAITS[name])
    steps = 1000
    standing = [0] * 4
    for _ in range(steps):
        clock.advance(clock.period / steps)
        for leg in range(4):
            standing[leg] += clock.swing(leg) < 0.0
    assert all(abs(count / steps - GAITS[name].duty) <= 0.002 for count in standing)


def test_a_trot_moves_diagonal_pairs_together() -> None:
    clock = GaitClock(GAITS["trot"])
    for _ in range(50):
        clock.advance(0.01)
        assert clock.swing(0) == pytest.approx(clock.swing(3))
        assert clock.swing(1) == pytest.approx(clock.swing(2))


@pytest.mark.parametrize("name", sorted(GAITS))
def test_a_walk_begins_just_before_the_first_foot_lifts(name: str) -> None:
    clock = GaitClock(GAITS[name])
    clock.restart()
    lifted_before = [clock.swing(leg) >= 0.0 for leg in range(4)]
    clock.advance(0.05 * clock.period)
    lifted_after = [clock.swing(leg) >= 0.0 for leg in range(4)]
    assert sum(lifted_after) > sum(lifted_before)


def test_a_hurried_gait_steps_faster_and_within_its_bounds() -> None:
    clock = GaitClock(GAITS["trot"])
    periods = []
    for speed in (0.0, 1.0, 1.3, 1.6, 3.0):
        clock.hurry(speed)
        periods.append(clock.period)
    assert periods == sorted(periods, reverse=True)
    assert (periods[0], periods[-1]) == (GAITS["trot"].period, GAITS["trot"].shortest)


def test_a_swing_starts_and_ends_at_rest_and_clears_the_ground_between() -> None:
    start, end = (0.0, 0.1, 0.0), (0.3, 0.1, 0.05)
    for progress, place in ((0.0, start), (1.0, end)):
        position, velocity = swing_path(start, end, progress, 0.25, 0.08)
        assert position == pytest.approx(place, abs=1e-12)
        assert velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    middle, _ = swing_path(start, end, 0.5, 0.25, 0.08)
    assert middle == pytest.approx((0.15, 0.1, 0.025 + 0.08))


@given(progress=st.floats(0.01, 0.99))
def test_swing_velocity_is_the_derivative_of_its_position(progress: float) -> None:
    start, end, duration, step = (0.0, 0.0, 0.0), (0.4, -0.1, 0.02), 0.23, 1e-6
    before, _ = swing_path(start, end, progress - step, duration, 0.06)
    after, _ = swing_path(start, end, progress + step, duration, 0.06)
    _, velocity = swing_path(start, end, progress, duration, 0.06)
    difference = [(b - a) / (2 * step * duration) for a, b in zip(before, after, strict=True)]
    assert velocity == pytest.approx(difference, abs=1e-5)


@given(vx=finite, vy=finite, wz=finite)
def test_commands_are_clipped_and_slewed(vx: float, vy: float, wz: float) -> None:
    shaper = CommandShaper(CommandLimits())
    assert shaper.ask(vx, vy, wz)
    before = shaper.velocity
    for _ in range(400):
        now = shaper.advance(0.005, walking=True)
        assert all(abs(a - b) <= most + 1e-12 for a, b, most in zip(now, before, (0.0075, 0.0075, 0.02), strict=True))
        before = now
    assert before == pytest.approx((max(-0.5, min(1.6, vx)), max(-0.4, min(0.4, vy)), max(-1.5, min(1.5, wz))))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_a_number_is_refused_and_counted(bad: float) -> None:
    shaper = CommandShaper(CommandLimits())
    shaper.ask(0.5, 0.0, 0.0)
    assert not shaper.ask(0.1, bad, 0.0)
    assert shaper.asked == (0.5, 0.0, 0.0)
    assert shaper.refused == 1


def test_legs_in_one_pass_agree_with_the_leg_functions() -> None:
    angles = [0.2, 0.9, -1.5, -0.1, 0.7, -1.2, 0.0, 1.1, -1.9, 0.3, 0.4, -0.8]
    legs = leg_state(angles, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(legs.feet, feet(angles), atol=1e-12)
    for leg, side in enumerate(SIDES):
        np.testing.assert_allclose(legs.jacobians[leg], leg_jacobian(side, *angles[3 * leg : 3 * leg + 3]), atol=1e-12)


def test_weight_torques_are_the_derivative_of_the_potential_energy() -> None:
    angles = [0.2, 0.9, -1.5, -0.1, 0.7, -1.2, 0.0, 1.1, -1.9, 0.3, 0.4, -0.8]
    up = (0.1, -0.2, math.sqrt(0.95))
    step = 1e-6

    def energy(q: list[float]) -> float:
        return MASS * GRAVITY * sum(a * b for a, b in zip(leg_state(q, up).centre, up, strict=True))

    for joint in range(12):
        high, low = list(angles), list(angles)
        high[joint] += step
        low[joint] -= step
        expected = (energy(high) - energy(low)) / (2 * step)
        assert leg_state(angles, up).weight[joint] == pytest.approx(expected, abs=1e-6)


def test_torques_and_speeds_are_the_jacobian_both_ways() -> None:
    jacobian = leg_jacobian(-1.0, 0.1, 0.8, -1.6)
    force, speed = np.array((10.0, -20.0, 150.0)), np.array((0.3, -0.2, 0.5))
    np.testing.assert_allclose(torques(jacobian, *force), -np.array(jacobian).T @ force)
    np.testing.assert_allclose(np.array(jacobian) @ joint_speeds(jacobian, *speed), speed, atol=1e-12)
    assert min(joint_speeds(jacobian, 100.0, 0.0, 0.0)) == -15.0
    assert joint_speeds(leg_jacobian(1.0, 0.0, 0.0, 0.0), 0.1, 0.1, 0.1) == (0.0, 0.0, 0.0)


def test_a_rolling_foot_moves_with_its_calf() -> None:
    """A ball foot on the ground whose calf turns by w moves by w times its radius, forwards."""
    angles = inverse(nominal_feet(0.45)).joints.tolist()
    speeds = [0.0, 0.4, 0.6] * 4
    up = (0.0, 0.0, 1.0)
    moving, rolling = foot_velocities(leg_state(angles, up), angles, speeds, (0.0, 0.0, 0.0), up)
    for leg in range(4):
        assert rolling[leg] == pytest.approx((0.036 * 1.0, 0.0, 0.0))
    step = 1e-6
    ahead = leg_forward(1.0, *(q + step * v for q, v in zip(angles[:3], speeds[:3], strict=True)))
    behind = leg_forward(1.0, *(q - step * v for q, v in zip(angles[:3], speeds[:3], strict=True)))
    assert moving[0] == pytest.approx(tuple(np.subtract(ahead, behind) / (2 * step)), abs=1e-6)


def test_four_feet_give_the_wrench_that_is_asked() -> None:
    arms = [(0.3, 0.16, -0.5), (0.3, -0.16, -0.5), (-0.3, 0.16, -0.5), (-0.3, -0.16, -0.5)]
    wrench = np.array((20.0, -10.0, 320.0, 5.0, -8.0, 3.0))
    forces = np.array(distribute(arms, wrench.tolist()))
    np.testing.assert_allclose(forces.sum(axis=0), wrench[:3], atol=0.5)
    np.testing.assert_allclose(np.cross(arms, forces).sum(axis=0), wrench[3:], atol=0.2)


@given(fx=st.floats(-500.0, 500.0), fy=st.floats(-500.0, 500.0), fz=st.floats(-100.0, 900.0))
def test_no_foot_pulls_or_slides(fx: float, fy: float, fz: float) -> None:
    forces = np.array(distribute([(0.3, 0.16, -0.5), (-0.3, -0.16, -0.5)], (fx, fy, fz, 0.0, 0.0, 0.0)))
    assert forces[:, 2].min() >= 10.0
    assert (np.hypot(forces[:, 0], forces[:, 1]) <= FRICTION * forces[:, 2] + 1e-9).all()


def test_the_terrain_plane_settles_on_the_slope() -> None:
    plane = TerrainPlane()
    contacts = [(x, y, 0.2 * x - 0.1 * y + 1.0) for x in (0.3, -0.3) for y in (0.2, -0.2)]
    for _ in range(400):
        plane.update(0.005, contacts)
    assert (plane.slope_x, plane.slope_y) == pytest.approx((0.2, -0.1), abs=1e-3)
    assert plane.height(1.0, 1.0) == pytest.approx(1.1, abs=5e-3)


def test_attitude_keeps_the_horizon_and_learns_the_bias_at_rest() -> None:
    attitude = AttitudeFilter()
    attitude.level((0.0, 0.0, GRAVITY))
    bias = (0.002, -0.001, 0.003)
    for _ in range(800):
        attitude.update(0.005, bias, (0.0, 0.0, GRAVITY), (0.0, 0.0, 0.0), still=True)
    assert attitude.bias.value == pytest.approx(bias, abs=2e-4)
    assert abs(attitude.roll) < 0.01
    assert abs(attitude.pitch) < 0.01


def test_attitude_integrates_turns_exactly() -> None:
    attitude = AttitudeFilter()
    for _ in range(200):
        attitude.update(0.005, (0.0, 0.0, 1.2), (0.0, 0.0, GRAVITY), (0.0, 0.0, 0.0), still=False)
    assert attitude.yaw == pytest.approx(1.2, abs=1e-6)


def test_own_acceleration_does_not_tilt_the_horizon() -> None:
    with_own, without = AttitudeFilter(), AttitudeFilter()
    for attitude, own in ((with_own, (1.5, 0.0, 0.0)), (without, (0.0, 0.0, 0.0))):
        for _ in range(100):
            attitude.update(0.005, (0.0, 0.0, 0.0), (1.5, 0.0, GRAVITY), own, still=False)
    assert abs(with_own.pitch) < 1e-9
    assert abs(without.pitch) > 0.02
