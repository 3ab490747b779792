"""Legs whose joints are not all known: where they should be by now, and how one that stands is held there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from robot.control.drive import Targets
from robot.estimation.leg_odometry import Estimator
from robot.geometry.vectors import Triple, Vector, to_body
from robot.hardware.body import MotorTargets
from robot.model.kinematics import leg_inverse
from robot.model.parameters import HIPS, SIDES

__all__ = ["expected_joints", "hold"]

SPRING: Final = 250.0
DAMPER: Final = 4.0
"""Joint gains of a leg that stands and is held, N m/rad and N m s/rad: those of a leg in the air."""


def expected_joints(told: MotorTargets, estimate: Estimator, walking: bool) -> Vector:
    """Where the joints should be by now, shape (12,), rad: where they were told to be, or of a leg that pushes, where its foot stands."""
    places = told.position.copy()
    if not walking:
        return places
    for leg in range(4):
        if told.kp[3 * leg] == 0.0:
            places[3 * leg : 3 * leg + 3] = _standing(estimate, leg)
    return places


def hold(targets: Targets, estimate: Estimator, joints: Iterable[int]) -> None:
    """Let the drives hold the legs of these `joints` where their feet stood, if they only push and their feet have lifted.

    A leg that pushes by joints that are not known swings freely without the ground, faster than the foot could be put down again.
    """
    for leg in {joint // 3 for joint in joints}:
        places = slice(3 * leg, 3 * leg + 3)
        if targets.kp[3 * leg] == 0.0 and not estimate.contact[leg]:
            targets.position[places] = _standing(estimate, leg)
            targets.kp[places], targets.kd[places] = (SPRING,) * 3, (DAMPER,) * 3


def _standing(estimate: Estimator, leg: int) -> Triple:
    """The joints of a leg whose foot is where it stood last, rad."""
    px, py, pz = estimate.position
    x, y, z = estimate.contacts[leg]
    fx, fy, fz = to_body(estimate.rotation, (x - px, y - py, z - pz))
    hip_x, hip_y = HIPS[leg]
    hip, shoulder, knee, *_ = leg_inverse(SIDES[leg], fx - hip_x, fy - hip_y, fz)
    return (hip, shoulder, knee)
