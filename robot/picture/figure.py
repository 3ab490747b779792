"""The robot as solids: every link where the true joint angles put it."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import NamedTuple

import numpy as np

from robot.geometry.vectors import Vector, rotation_of
from robot.model.arm import FORE, MOUNT, TOOL, UPPER
from robot.model.kinematics import leg_forward
from robot.model.parameters import ABDUCTION, CALF, FOOT_RADIUS, HIPS, SIDES, THIGH, TRUNK
from robot.picture import palette
from robot.picture.solids import Solid, ball, box, capsule, stick
from robot.sim.simulation import Truth


class Leg(NamedTuple):
    """The joints of one leg in the body frame, m."""

    hip: Vector
    shoulder: Vector
    knee: Vector
    foot: Vector


def legs(joints: Vector) -> list[Leg]:
    """The four legs at 12 joint angles (rad)."""
    found: list[Leg] = []
    for leg, ((hip_x, hip_y), side) in enumerate(zip(HIPS, SIDES, strict=True)):
        q1, q2, q3 = joints[3 * leg : 3 * leg + 3].tolist()
        hip = np.array((hip_x, hip_y, 0.0))
        shoulder = hip + side * ABDUCTION * np.array((0.0, cos(q1), sin(q1)))
        foot = hip + np.array(leg_forward(side, q1, q2, q3))
        calf = np.array((-sin(q2 + q3), sin(q1) * cos(q2 + q3), -cos(q1) * cos(q2 + q3)))
        found.append(Leg(hip, shoulder, foot - CALF * calf, foot))
    return found


def robot_solids(truth: Truth, arm: Sequence[float] | None = None) -> list[Solid]:
    """The robot in the world; with `arm`, the angles (rad) of its four joints, it carries one."""
    axes = rotation_of(truth.quaternion)
    solids = _trunk(truth.position, axes)
    for leg, side in zip(legs(truth.joints), SIDES, strict=True):
        solids += _leg(Leg(*(truth.position + axes @ joint for joint in leg)), axes[:, 1] * side)
    return solids if arm is None else solids + _arm(truth.position, axes, arm)


def arm_joints(angles: Sequence[float]) -> list[Vector]:
    """Shoulder, elbow, wrist and the tool's tip in the body frame, m."""
    turn, *pitches = angles
    places, pitch = [np.array(MOUNT)], 0.0
    for length, bend in zip((UPPER, FORE, TOOL), pitches, strict=True):
        pitch += bend
        along = np.array((cos(pitch) * cos(turn), cos(pitch) * sin(turn), -sin(pitch)))
        places.append(places[-1] + length * along)
    return places


def _arm(origin: Vector, axes: Vector, angles: Sequence[float]) -> list[Solid]:
    shoulder, elbow, wrist, tip = (origin + axes @ place for place in arm_joints(angles))
    turn = angles[0]
    side = axes @ np.array((-sin(turn), cos(turn), 0.0))
    jaw = (tip - wrist) / TOOL
    palm = wrist + 0.55 * (tip - wrist)
    fingers = [
        capsule(palm + offset * side, palm + offset * side + 0.09 * jaw, 0.011, palette.DARK, gloss=0.4)
        for offset in (-0.035, 0.035)
    ]
    return [
        stick(shoulder - 0.1 * axes[:, 2], shoulder, 0.055, palette.GRAPHITE, rounding=0.01, gloss=0.3),
        stick(shoulder - 0.05 * side, shoulder + 0.05 * side, 0.05, palette.DARK, rounding=0.012, gloss=0.4),
        capsule(shoulder, elbow, 0.036, palette.ROBOT, gloss=0.5),
        stick(elbow - 0.045 * side, elbow + 0.045 * side, 0.042, palette.DARK, rounding=0.012, gloss=0.4),
        capsule(elbow, wrist, 0.031, palette.ROBOT, gloss=0.5),
        capsule(wrist, palm, 0.034, palette.GRAPHITE, gloss=0.3),
        stick(palm - 0.045 * side, palm + 0.045 * side, 0.018, palette.GRAPHITE, rounding=0.006, gloss=0.3),
        *fingers,
    ]


def _trunk(origin: Vector, axes: Vector) -> list[Solid]:
    length, width, height = TRUNK

    def at(x: float, y: float, z: float) -> Vector:
        place: Vector = origin + axes @ np.array((x, y, z))
        return place

    nose = length / 2.0
    solids = [
        box(at(0.0, 0.0, 0.0), axes, (length, width, height), palette.ROBOT, rounding=0.055, gloss=0.5),
        box(at(0.0, 0.0, -0.075), axes, (0.56, width - 0.04, 0.09), palette.GRAPHITE, rounding=0.03, gloss=0.2),
        box(at(0.0, 0.0, 0.086), axes, (0.46, 0.12, 0.03), palette.GRAPHITE, rounding=0.012, gloss=0.3),
        box(at(nose - 0.012, 0.0, 0.0), axes, (0.05, 0.17, 0.12), palette.GLASS, rounding=0.02, gloss=1.0),
        box(at(0.012 - nose, 0.0, 0.0), axes, (0.05, 0.15, 0.10), palette.DARK, rounding=0.02, gloss=0.5),
        stick(at(0.16, 0.0, 0.09), at(0.16, 0.0, 0.125), 0.05, palette.DARK, rounding=0.006, gloss=0.6),
        stick(at(0.16, 0.0, 0.125), at(0.16, 0.0, 0.145), 0.046, palette.CHARGE, rounding=0.004, gloss=0.6),
        stick(at(0.16, 0.0, 0.145), at(0.16, 0.0, 0.165), 0.05, palette.DARK, rounding=0.006, gloss=0.6),
    ]
    for y in (-0.045, 0.045):
        solids.append(ball(at(nose + 0.006, y, 0.012), 0.016, palette.JOINT, gloss=1.0))
    for x in (-HIPS[0][0], HIPS[0][0]):
        solids.append(
            stick(at(x - 0.07, 0.0, 0.0), at(x + 0.07, 0.0, 0.0), 0.098, palette.GRAPHITE, rounding=0.02, gloss=0.3)
        )
    return solids


def _leg(leg: Leg, outward: Vector) -> list[Solid]:
    thigh, shin = leg.knee - leg.shoulder, leg.foot - leg.knee
    along, down = thigh / THIGH, shin / CALF
    return [
        capsule(leg.hip, leg.shoulder - 0.02 * outward, 0.062, palette.GRAPHITE, gloss=0.3),
        stick(
            leg.shoulder - 0.05 * outward,
            leg.shoulder + 0.055 * outward,
            0.066,
            palette.ROBOT,
            rounding=0.018,
            gloss=0.5,
        ),
        stick(
            leg.shoulder + 0.05 * outward,
            leg.shoulder + 0.062 * outward,
            0.04,
            palette.GRAPHITE,
            rounding=0.005,
            gloss=0.4,
        ),
        capsule(leg.shoulder + 0.05 * along, leg.knee - 0.11 * along, 0.047, palette.ROBOT, gloss=0.5),
        capsule(leg.shoulder, leg.knee, 0.037, palette.GRAPHITE, gloss=0.3),
        stick(leg.knee - 0.042 * outward, leg.knee + 0.042 * outward, 0.042, palette.DARK, rounding=0.012, gloss=0.4),
        capsule(leg.knee, leg.foot, 0.021, palette.GRAPHITE, gloss=0.4),
        capsule(leg.knee + 0.03 * down, leg.knee + 0.15 * down, 0.027, palette.GRAPHITE, gloss=0.4),
        ball(leg.foot, FOOT_RADIUS, palette.RUBBER, gloss=0.1),
    ]
