"""The leg's closed-form kinematics: forward and inverse undo each other, the Jacobian is the derivative."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot.model.kinematics import (
    feet,
    inverse,
    leg_forward,
    leg_inverse,
    leg_jacobian,
    within_limits,
)
from robot.model.parameters import CALF, HIPS, JOINT_LIMITS, SIDES, STAND_HEIGHT, THIGH

POSES = 2000


def poses() -> list[tuple[float, tuple[float, float, float]]]:
    """Random poses inside the joint limits whose foot is more than 5 cm below the hip axis."""
    generator = np.random.default_rng(7)
    low, high = np.array(JOINT_LIMITS[:3]).T
    found: list[tuple[float, tuple[float, float, float]]] = []
    while len(found) < POSES:
        q1, q2, q3 = generator.uniform(low, high).tolist()
        if -THIGH * math.cos(q2) - CALF * math.cos(q2 + q3) < -0.05:
            found.append((1.0 if len(found) % 2 else -1.0, (q1, q2, q3)))
    return found


def test_inverse_of_forward_gives_the_angles_back() -> None:
    for side, q in poses():
        answer = leg_inverse(side, *leg_forward(side, *q))
        assert answer.reachable
        assert max(abs(a - b) for a, b in zip(answer[:3], q, strict=True)) <= 1e-9


def test_forward_of_inverse_gives_the_point_back() -> None:
    for side, q in poses():
        point = leg_forward(side, *q)
        again = leg_forward(side, *leg_inverse(side, *point)[:3])
        assert math.dist(point, again) <= 1e-9


def test_jacobian_is_the_derivative() -> None:
    step = 1e-6
    for side, q in poses():
        rows = leg_jacobian(side, *q)
        for joint in range(3):
            ahead, behind = list(q), list(q)
            ahead[joint] += step
            behind[joint] -= step
            difference = np.subtract(leg_forward(side, *ahead), leg_forward(side, *behind)) / (2 * step)
            assert np.abs(difference - [row[joint] for row in rows]).max() <= 1e-6


@pytest.mark.parametrize("point", [(0.0, 0.11, -0.70), (0.5, 0.11, -0.5), (0.0, 0.11, -0.005)])
def test_a_point_out_of_reach_is_reported_and_answered_with_the_nearest_leg(point: tuple[float, float, float]) -> None:
    answer = leg_inverse(1.0, *point)
    assert not answer.reachable
    assert all(math.isfinite(angle) for angle in answer[:3])
    assert answer.q3 == pytest.approx(0.0 if math.hypot(*point) > 0.5 else -math.pi)


def test_four_legs_at_once_are_the_four_legs() -> None:
    stand = np.array([(x, y + 0.1108 * side, -STAND_HEIGHT) for (x, y), side in zip(HIPS, SIDES, strict=True)])
    joints, reachable = inverse(stand)
    assert reachable == (True, True, True, True)
    np.testing.assert_allclose(feet(joints), stand, atol=1e-12)
    assert within_limits(joints)


def test_limits_refuse_a_straight_knee() -> None:
    joints = np.array([0.0, 0.8, -1.6] * 4)
    assert within_limits(joints)
    joints[5] = -0.1
    assert not within_limits(joints)
