"""Legs whose joints are not all known: where they are taken to be while they swing, land, push and lift, and how they are held."""

from __future__ import annotations

import numpy as np
import pytest

from robot.control.doubtful_legs import DoubtfulLegs
from robot.control.drive import Targets
from robot.estimation.leg_odometry import Estimator
from robot.geometry.vectors import Vector
from robot.hardware.body import MotorTargets
from robot.model.kinematics import feet, inverse
from robot.model.stance import nominal_feet
from tests.robot.control.kit import AT_REST, DT, HEIGHT, joints_at

LEG = 1
KNEE = 3 * LEG + 2
PUSHES = Targets().freeze()
"""No leg is led: all of them push."""
STOOD = nominal_feet(HEIGHT)


def seen(at: Vector, contact: bool) -> Estimator:
    """What is known of a robot that stood at its nominal places, after its leg was seen at another place."""
    estimate = Estimator()
    estimate.update(DT, AT_REST, joints_at(STOOD))
    estimate.update(DT, AT_REST, joints_at(at, tuple(contact or leg != LEG for leg in range(4))))
    return estimate


def moved(x: float, z: float = 0.0) -> Vector:
    at = STOOD.copy()
    at[LEG] += (x, 0.0, z)
    return at


def led(at: Vector) -> MotorTargets:
    """The leg is led to its foot at this place."""
    targets = Targets()
    targets.leg(LEG, effort=(0.0,) * 3, position=inverse(at).joints[3 * LEG : 3 * LEG + 3].tolist(), kp=250.0)
    return targets.freeze()


def foot(joints: Vector) -> Vector:
    return np.asarray(feet(joints)[LEG])


def test_a_leg_in_the_air_is_where_it_was_told_to_be() -> None:
    told = led(moved(0.1, 0.05))
    joints = DoubtfulLegs().joints(told, seen(STOOD, contact=False), walking=True)
    assert foot(joints) == pytest.approx(moved(0.1, 0.05)[LEG])


def test_a_leg_that_is_told_to_push_before_its_foot_was_felt_is_where_it_was_led_and_not_where_it_stood() -> None:
    """At the end of a swing, the foot a step ahead of where it stood last."""
    legs, estimate = DoubtfulLegs(), seen(moved(0.35), contact=False)
    legs.joints(led(moved(0.4, -0.01)), estimate, walking=True)
    assert foot(legs.joints(PUSHES, estimate, walking=True)) == pytest.approx(moved(0.4, -0.01)[LEG], abs=2e-3)


def test_a_doubt_that_begins_in_that_moment_takes_the_foot_where_it_was_seen_last() -> None:
    estimate = seen(moved(0.3), contact=False)
    assert foot(DoubtfulLegs().joints(PUSHES, estimate, walking=True)) == pytest.approx(moved(0.3)[LEG], abs=2e-3)


def test_a_foot_that_is_felt_stays_where_it_stands_while_the_body_moves_on() -> None:
    legs, estimate = DoubtfulLegs(), seen(STOOD, contact=True)
    legs.joints(led(moved(0.2)), estimate, walking=True)
    x, y, z = estimate.position
    estimate.position = (x + 0.05, y, z)
    assert foot(legs.joints(PUSHES, estimate, walking=True)) == pytest.approx(moved(-0.05)[LEG], abs=2e-3)


def test_a_robot_that_does_not_walk_is_where_it_was_told_to_be() -> None:
    told = led(moved(0.1))
    assert DoubtfulLegs().joints(told, seen(STOOD, contact=True), walking=False).tolist() == told.position.tolist()


@pytest.mark.parametrize(
    ("contact", "doubtful", "held"), [(False, (KNEE,), True), (True, (KNEE,), False), (False, (), False)]
)
def test_the_drives_hold_a_leg_that_pushes_without_the_ground_and_no_other(
    contact: bool, doubtful: tuple[int, ...], held: bool
) -> None:
    legs, estimate = DoubtfulLegs(), seen(STOOD, contact)
    legs.joints(led(moved(0.1)), seen(STOOD, contact=False), walking=True)
    targets = Targets()
    legs.hold(targets, estimate, doubtful)
    assert targets.kp == [250.0 if held and joint // 3 == LEG else 0.0 for joint in range(12)]
    if held:
        assert foot(np.array(targets.position)) == pytest.approx(moved(0.1)[LEG], abs=2e-3)


def test_a_doubt_that_is_over_leaves_nothing_for_the_next_one() -> None:
    legs, estimate = DoubtfulLegs(), seen(STOOD, contact=False)
    legs.joints(led(moved(0.4)), estimate, walking=True)
    legs.hold(Targets(), estimate, ())
    assert foot(legs.joints(PUSHES, estimate, walking=True)) == pytest.approx(STOOD[LEG], abs=2e-3)
