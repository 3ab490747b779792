"""Kinematics of one leg and of all four, exact and in closed form.

Frames: the hip frame has the body's axes (x forward, y left, z up) and its origin on the hip axis. Angles: q1 hip about +x,
q2 shoulder about +y, q3 knee about +y, negative where it bends backwards. `side` is +1 for a left leg and -1 for a right one. With the leg
straight down all angles are zero and the foot's centre is at (0, side d, -(L1 + L2)).

The functions of one leg work on plain floats: four legs cost less that way than as arrays of four.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, cos, pi, sin, sqrt, tau
from typing import NamedTuple

import numpy as np

from robot.geometry.vectors import Triple, Vector
from robot.model.robot import SPOT, RobotModel

_SHORTEST = 1e-4
"""Least height (m) of the leg plane that the inverse works with: closer to the hip axis the hip angle is undefined."""


class LegAngles(NamedTuple):
    """The joint angles of one leg, and whether the asked point can be reached with them."""

    q1: float
    q2: float
    q3: float
    reachable: bool
    """False: the point lies out of reach and the angles lead to the nearest bent or stretched leg in its direction."""


class Reach(NamedTuple):
    """The joint angles (shape (12,)) of four legs, and per leg whether the asked point can be reached."""

    joints: Vector
    reachable: tuple[bool, bool, bool, bool]


def leg_forward(side: float, q1: float, q2: float, q3: float, model: RobotModel = SPOT) -> Triple:
    """The foot's centre in the hip frame, metres."""
    thigh, calf = model.thigh, model.calf
    q23 = q2 + q3
    height = -thigh * cos(q2) - calf * cos(q23)
    c1, s1 = cos(q1), sin(q1)
    offset = side * model.abduction
    return (-thigh * sin(q2) - calf * sin(q23), offset * c1 - height * s1, offset * s1 + height * c1)


def leg_inverse(side: float, x: float, y: float, z: float, model: RobotModel = SPOT, bend: float = -1.0) -> LegAngles:
    """The angles that put the foot's centre at (x, y, z) of the hip frame, for a foot below the hip. `bend` is -1 for a knee that bends backwards,
    +1 for one that bends forwards.

    A point out of reach is answered with the nearest angles and `reachable` False. Joint limits are not applied here: ask
    `within_limits`.
    """
    thigh, calf, abduction = model.thigh, model.calf, model.abduction
    offset = side * abduction
    squared = y * y + z * z - abduction * abduction
    reachable = squared >= _SHORTEST * _SHORTEST
    height = -sqrt(squared) if reachable else -_SHORTEST
    q1 = atan2(z, y) - atan2(height, offset)
    q1 -= tau * round(q1 / tau)
    c3 = (x * x + height * height - thigh * thigh - calf * calf) / (2.0 * thigh * calf)
    if c3 > 1.0:
        c3, reachable = 1.0, False
    elif c3 < -1.0:
        c3, reachable = -1.0, False
    q3 = bend * acos(c3)
    q2 = atan2(-x, -height) - atan2(calf * sin(q3), thigh + calf * c3)
    if q2 > pi:
        q2 -= tau
    elif q2 < -pi:
        q2 += tau
    return LegAngles(q1, q2, q3, reachable)


def leg_jacobian(
    side: float, q1: float, q2: float, q3: float, model: RobotModel = SPOT
) -> tuple[Triple, Triple, Triple]:
    """The derivative of `leg_forward`, as rows x, y, z against columns q1, q2, q3 (m/rad)."""
    q23 = q2 + q3
    thigh, calf = model.thigh, model.calf
    calf_x, calf_z = calf * sin(q23), calf * cos(q23)
    height = -thigh * cos(q2) - calf_z
    x = -thigh * sin(q2) - calf_x
    c1, s1 = cos(q1), sin(q1)
    offset = side * model.abduction
    return (
        (0.0, height, -calf_z),
        (-offset * s1 - height * c1, x * s1, -calf_x * s1),
        (offset * c1 - height * s1, -x * c1, calf_x * c1),
    )


def feet(joints: Sequence[float] | Vector, model: RobotModel = SPOT) -> Vector:
    """The four feet's centres in the body frame, shape (4, 3), for 12 joint angles in the order of `JOINT_NAMES`."""
    q = [float(angle) for angle in joints]
    rows: list[Triple] = []
    for leg, ((hip_x, hip_y), side) in enumerate(zip(model.hips, model.sides, strict=True)):
        x, y, z = leg_forward(side, q[3 * leg], q[3 * leg + 1], q[3 * leg + 2], model)
        rows.append((hip_x + x, hip_y + y, z))
    return np.array(rows)


def inverse(points: Vector, model: RobotModel = SPOT) -> Reach:
    """The 12 joint angles that put the feet's centres at `points` of the body frame, shape (4, 3)."""
    legs = [
        leg_inverse(side, x - hip_x, y - hip_y, z, model, bend)
        for (x, y, z), (hip_x, hip_y), side, bend in zip(
            points.tolist(), model.hips, model.sides, model.bends, strict=True
        )
    ]
    fl, fr, rl, rr = (leg.reachable for leg in legs)
    return Reach(np.array([angle for leg in legs for angle in leg[:3]]), (fl, fr, rl, rr))


def within_limits(joints: Sequence[float] | Vector, margin: float = 0.0, model: RobotModel = SPOT) -> bool:
    """Whether all 12 angles lie inside the joint limits, at least `margin` rad from each."""
    limits = zip(joints, model.joint_limits, strict=True)
    return all(low + margin <= angle <= high - margin for angle, (low, high) in limits)
