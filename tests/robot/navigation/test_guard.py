"""Driving by hand: slowed down and stopped short of what is seen, free to leave it, and let alone in the open."""

from __future__ import annotations

from math import hypot, pi

import pytest

from robot.geometry.planar import Pose2, Twist2
from robot.navigation.guard import Guard
from robot.scenes.scene import Box, Cylinder
from tests.robot.navigation.navigation_sim import VelocityPlant, body_clearance
from tests.robot.stage import floor

BOX = Box(3.0, 0.0, 0.5, 0.5)


def drive(plant: VelocityPlant, command: Twist2, seconds: float) -> tuple[float, float]:
    """Hold a command, looking ten times a second: the least clearance (m), and the speed at the end (m/s)."""
    guard, least = Guard(), body_clearance(plant.scene, plant.pose)
    for _ in range(round(10 * seconds)):
        guard.see(plant.time, plant.scan())
        told, _ = guard.limit(command)
        plant.advance(told, 0.1)
        least = min(least, body_clearance(plant.scene, plant.pose))
    return least, hypot(plant.velocity.vx, plant.velocity.vy)


@pytest.mark.parametrize(
    ("command", "start"),
    [
        (Twist2(1.0, 0.0, 0.0), Pose2(0.0, 0.0)),
        (Twist2(1.6, 0.0, 0.0), Pose2(0.0, 0.2)),
        (Twist2(-0.5, 0.0, 0.0), Pose2(0.0, 0.0, pi)),
        (Twist2(0.0, 0.4, 0.0), Pose2(3.0, -1.5)),
        (Twist2(0.5, 0.0, 0.0), Pose2(0.0, 0.0)),
    ],
)
def test_the_robot_stops_short_of_what_stands_in_its_way(command: Twist2, start: Pose2) -> None:
    plant = VelocityPlant(floor(BOX), start)
    least, speed = drive(plant, command, 9.0)
    assert 0.05 < least < 0.3
    assert speed < 0.02


def test_turning_beside_a_post_stops_before_a_corner_touches_it() -> None:
    plant = VelocityPlant(floor(Cylinder(0.45, 0.5, 0.1)), Pose2(0.0, 0.0))
    least, _ = drive(plant, Twist2(0.0, 0.0, 1.0), 4.0)
    assert least > 0.03


def test_a_robot_that_stands_too_near_may_leave() -> None:
    plant = VelocityPlant(floor(BOX), Pose2(2.15, 0.0))
    assert body_clearance(plant.scene, plant.pose) < 0.1
    drive(plant, Twist2(-0.5, 0.0, 0.0), 2.0)
    assert plant.pose.x < 1.4


def test_along_a_wall_and_in_the_open_it_is_let_alone() -> None:
    plant = VelocityPlant(floor(Box(0.0, 0.7, 30.0, 0.2)), Pose2(-5.0, 0.0))
    drive(plant, Twist2(1.0, 0.0, 0.0), 5.0)
    assert plant.pose.x > -0.6
    assert Guard().limit(Twist2(1.6, 0.0, 0.0))[0] == Twist2(1.6, 0.0, 0.0), "nothing has been seen yet"
