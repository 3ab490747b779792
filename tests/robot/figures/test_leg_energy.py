"""The prediction of what a walk will take, against laws that are known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.planning.energy import walking_energy
from tests.figures.leg_energy import LegEnergy, RouteEnergy, turning


def walks(seed: int, count: int) -> list[tuple[float, float]]:
    """Lengths (m) and turnings (rad)."""
    random = np.random.default_rng(seed)
    return [(float(random.uniform(2.0, 15.0)), float(random.uniform(0.0, 6.0))) for _ in range(count)]


def test_before_the_first_walk_it_says_what_is_typical() -> None:
    law = LegEnergy(0.7)
    ten, twenty = law.predict(10.0, 0.0), law.predict(20.0, 0.0)
    assert twenty - ten == pytest.approx(walking_energy(10.0, 0.7))
    assert law.predict(10.0, pi) > ten


def test_after_a_lap_it_predicts_a_robot_that_takes_more_than_is_typical() -> None:
    law = LegEnergy(0.7)
    for length, turn in walks(1, 6):
        law.learn(length, turn, 0.19 * length + 0.06 * turn + 0.1)
    for length, turn in walks(2, 20):
        true = 0.19 * length + 0.06 * turn + 0.1
        assert law.predict(length, turn) == pytest.approx(true, rel=0.01)


def test_a_robot_that_carries_more_from_now_on_is_followed() -> None:
    law = LegEnergy(0.7)
    for length, turn in walks(1, 40):
        law.learn(length, turn, 0.17 * length)
    for length, turn in walks(2, 40):
        law.learn(length, turn, 0.21 * length)
    assert law.predict(10.0, 2.0) == pytest.approx(2.1, rel=0.05)


def test_walks_that_take_more_or_less_by_chance_are_averaged() -> None:
    law, random = LegEnergy(0.7), np.random.default_rng(3)
    for length, turn in walks(4, 100):
        law.learn(length, turn, (0.18 * length + 0.05 * turn + 0.1) * random.normal(1.0, 0.03))
    assert law.predict(10.0, 2.0) == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize(
    ("points", "goal_yaw", "expected"),
    [
        ([(0.0, 0.0), (4.0, 0.0)], 0.0, 0.0),
        ([(0.0, 0.0), (-4.0, 0.0)], pi, pi),
        ([(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (5.0, 3.0)], pi / 2, 3 * pi / 2),
        ([(0.0, 0.0), (0.05, 0.05), (0.1, 0.0), (4.0, 0.0)], 0.0, 0.0),  # a path is drawn on cells
        ([(0.0, 0.0), (0.1, 0.1)], -1.0, 1.0),
    ],
)
def test_the_turning_is_that_of_the_courses_and_of_both_ends(
    points: list[tuple[float, float]], goal_yaw: float, expected: float
) -> None:
    assert turning(Pose2(0.0, 0.0, 0.0), np.array(points), goal_yaw) == pytest.approx(expected, abs=1e-9)


A, B, C = Pose2(0.0, 0.0), Pose2(8.0, 0.0), Pose2(8.0, 5.0, pi / 2)


def test_a_route_that_was_walked_takes_what_it_took_whatever_the_law_says_of_others() -> None:
    energy = RouteEnergy(0.7)
    energy.learn(A, B, 8.0, 0.5, 2.4)
    for length, turn in walks(5, 20):
        energy.learn(B, C, length, turn, 0.15 * length)
    assert energy.predict(Pose2(0.1, -0.1, 0.1), B, 8.0, 0.5) == pytest.approx(2.4)
    longer = energy.predict(A, B, 8.5, 0.5) - 2.4
    assert longer == pytest.approx(0.5 * 0.15, abs=0.02)


def test_the_same_ends_by_another_way_or_in_another_direction_are_another_route() -> None:
    energy, law = RouteEnergy(0.7), LegEnergy(0.7)
    energy.learn(A, B, 8.0, 0.5, 4.0)
    law.learn(8.0, 0.5, 4.0)
    assert energy.predict(A, B, 12.0, 2.0) == law.predict(12.0, 2.0)
    assert energy.predict(B, A, 8.0, 0.5) == law.predict(8.0, 0.5)
    assert energy.predict(Pose2(0.0, 0.0, pi), B, 8.0, 0.5) == law.predict(8.0, 0.5)


def test_a_route_that_takes_more_from_now_on_is_followed_and_chance_is_averaged() -> None:
    energy, random = RouteEnergy(0.7), np.random.default_rng(6)
    for _ in range(30):
        energy.learn(A, B, 8.0, 0.5, 2.0 * random.normal(1.0, 0.02))
    assert energy.predict(A, B, 8.0, 0.5) == pytest.approx(2.0, rel=0.02)
    for _ in range(10):
        energy.learn(A, B, 8.0, 0.5, 2.3)
    assert energy.predict(A, B, 8.0, 0.5) == pytest.approx(2.3, rel=0.01)
