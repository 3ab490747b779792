"""People and things that move in the physics body."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Scene, Walker
from robot.sim.walkers import Walkers

FAR = Pose2(50.0, 50.0)


def scene(*walkers: Walker) -> Scene:
    return Scene("walkers", (-5.0, -5.0, 5.0, 5.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0), walkers=walkers)


def after(walkers: Walkers, seconds: float, robot: Pose2, begin: float = 0.0) -> list[float]:
    for tick in range(1, round(seconds * 100) + 1):
        walkers.advance(begin + 0.01 * tick, robot)
    return walkers.places[0, :2].tolist()


def test_somebody_walks_from_place_to_place_at_their_speed() -> None:
    walkers = Walkers(scene(Walker(Cylinder(0.0, 0.0, 0.25), ((2.0, 0.0), (2.0, 2.0)), speed=1.0)))
    assert after(walkers, 1.5, FAR) == pytest.approx([1.5, 0.0], abs=0.02)
    assert after(walkers, 1.5, FAR, begin=1.5) == pytest.approx([2.0, 1.0], abs=0.05)


def test_somebody_stops_before_the_robot_and_one_who_stops_for_nobody_does_not() -> None:
    robot = Pose2(2.0, 0.0, np.pi / 2)  # its side is 0.25 m from its middle
    polite = Walkers(scene(Walker(Cylinder(0.0, 0.0, 0.25), ((4.0, 0.0),), speed=1.0)))
    x, _ = after(polite, 2.0, robot)
    assert 1.0 < x < 2.0 - 0.25 - 0.25
    rude = Walkers(scene(Walker(Cylinder(0.0, 0.0, 0.25), ((4.0, 0.0),), speed=1.0, room=0.0)))
    assert after(rude, 2.0, robot)[0] == pytest.approx(2.0, abs=0.02)


def test_a_thing_appears_in_its_time() -> None:
    walkers = Walkers(scene(Walker(Box(1.0, 0.0, 0.4, 0.4), appears=2.0)))
    after(walkers, 1.9, FAR)
    assert walkers.shapes == ()
    after(walkers, 0.2, FAR, begin=1.9)
    assert [(one.x, one.y) for one in walkers.shapes] == [(1.0, 0.0)]


def test_the_physics_body_touches_who_walks_into_it_and_its_lidar_sees_them_where_they_are() -> None:
    pytest.importorskip("mujoco")
    from robot.sim.physics import PhysicsBody

    body = PhysicsBody(scene(Walker(Cylinder(3.0, 0.0, 0.25, 1.7), ((-3.0, 0.0),), room=0.0)), seed=1, noise=False)
    body.advance(1.0)
    assert body.lidar()[180] == pytest.approx(1.75, abs=0.02)
    assert [one.x for one in body.obstacles()] == pytest.approx([2.0], abs=0.01)
    assert body.truth().touching == ()
    touched: set[str] = set()
    for tick in range(100, 300):
        body.advance(0.01 * tick)
        touched.update(body.truth().touching)
    assert touched == {"walker_0"}
