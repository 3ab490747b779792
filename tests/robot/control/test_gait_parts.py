"""The parts of the gait: pattern, swing path, command shaping, legs' statics, force distribution, terrain plane, attitude."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from robot.control.drive import joint_speeds
from robot.estimation.attitude import AttitudeFilter
from robot.estimation.terrain import TerrainPlane
from robot.model.kinematics import feet, inverse, leg_forward, leg_jacobian
from robot.model.legs import foot_velocities, leg_state, torques
from robot.model.parameters import GRAVITY, MASS, SIDES
from robot.model.stance import nominal_feet

finite = st.floats(-10.0, 10.0)


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
