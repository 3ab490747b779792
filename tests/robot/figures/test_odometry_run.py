"""The halls that odometry is measured in, their courses, and a short walk through one."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from math import cos, hypot, inf, sin

import pytest

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box
from robot.sim.ground import Ground, Ice
from robot.sim.physics import PhysicsBody
from tests.figures.fidelity import Fidelity
from tests.figures.odometry_run import astray
from tests.figures.odometry_worlds import Hall, flat_hall, rough_hall

HALF_A_WALL = 0.2
"""Boxes thinner than this are walls, m."""


def walked(hall: Hall, seconds: float) -> list[Pose2]:
    """Where a robot is that does exactly what the course says, every 0.1 s."""
    x = y = yaw = 0.0
    way: list[Pose2] = []
    while 0.1 * len(way) < seconds:
        vx, vy, wz = hall.course((x, y, yaw))
        for _ in range(round(hall.stretch / 0.1)):
            x, y = x + 0.1 * (vx * cos(yaw) - vy * sin(yaw)), y + 0.1 * (vx * sin(yaw) + vy * cos(yaw))
            yaw += 0.1 * wz
            way.append(Pose2(x, y, yaw))
    return way


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_a_course_leads_far_and_past_everything_that_stands_in_the_hall(seed: int) -> None:
    hall = flat_hall(seed)
    way = walked(hall, 150.0)
    assert sum(hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(way)) > 80.0
    x0, y0, x1, y1 = hall.scene.bounds
    for pose in way:
        assert x0 + 0.5 < pose.x < x1 - 0.5
        assert y0 + 0.5 < pose.y < y1 - 0.5
        for one in hall.scene.obstacles:
            reach = 0.5 * hypot(one.length, one.width) if isinstance(one, Box) else one.radius
            if not (isinstance(one, Box) and min(one.length, one.width) < HALF_A_WALL):
                assert hypot(pose.x - one.x, pose.y - one.y) > reach + 0.3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_rough_yard_is_left_by_no_course_and_what_is_to_be_seen_stands_around_it(seed: int) -> None:
    hall = rough_hall(seed)
    high = [one for one in hall.scene.obstacles if one.height > 0.5]
    low = [one for one in hall.scene.obstacles if one.height <= 0.05]
    assert len(high) == 14 + 4
    assert len(low) > 200
    assert len(high) + len(low) == len(hall.scene.obstacles)
    assert all(hypot(pose.x, pose.y) < 4.6 for pose in walked(hall, 150.0))


def test_the_same_seed_gives_the_same_hall_and_course() -> None:
    assert flat_hall(3).scene == flat_hall(3).scene
    assert flat_hall(3).scene != flat_hall(4).scene
    assert walked(flat_hall(3), 20.0) == walked(flat_hall(3), 20.0)


def test_a_walk_of_two_metres_is_judged_by_where_it_really_ended() -> None:
    error = astray(3, 0.004, Fidelity(), 2.0, rough=False)
    assert 0.0 < error < 5.0


@pytest.mark.slow(reason="a long walk")
def test_a_robot_that_gives_up_the_walk_ends_the_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    icy = partial(PhysicsBody, ground=Ground(ice=Ice(0.05, 1.0, 100.0)))
    monkeypatch.setattr("tests.figures.odometry_run.PhysicsBody", icy)
    assert astray(3, 0.004, Fidelity(), 20.0, rough=False) == inf
