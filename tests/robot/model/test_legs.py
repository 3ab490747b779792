"""The four legs in one pass: feet, Jacobians, the torques of their weight, rolling feet."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot.model.kinematics import feet, inverse, leg_forward, leg_jacobian
from robot.model.legs import foot_velocities, leg_state, torques
from robot.model.parameters import GRAVITY, MASS, SIDES
from robot.model.stance import nominal_feet


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


def test_torques_are_minus_the_transposed_jacobian_times_the_force() -> None:
    jacobian = leg_jacobian(-1.0, 0.1, 0.8, -1.6)
    force = np.array((10.0, -20.0, 150.0))
    np.testing.assert_allclose(torques(jacobian, *force), -np.array(jacobian).T @ force)


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
