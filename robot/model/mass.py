"""How the robot's mass lies when it stands: computed from its links for any height, feet straight below the shoulders."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from robot.geometry.vectors import Triple, Vector
from robot.model.kinematics import inverse
from robot.model.robot import SPOT, RobotModel
from robot.model.stance import nominal_feet


class StandingMass(NamedTuple):
    """Centre of mass and inertia of the whole robot, level, heading axes."""

    behind: float
    """How far the centre of mass lies behind the body origin, m: the legs bend backwards and weigh 54 %."""
    inertia: Triple
    """About the centre of mass: roll, pitch, yaw, kg m2."""

    def between(self, other: StandingMass, share: float) -> StandingMass:
        """This one at `share` 0, the other at 1, linear between them."""
        a, b, c = (mine + share * (theirs - mine) for mine, theirs in zip(self.inertia, other.inertia, strict=True))
        return StandingMass(self.behind + share * (other.behind - self.behind), (a, b, c))


@lru_cache(maxsize=64)
def standing_mass(height: float, model: RobotModel = SPOT) -> StandingMass:
    """Of a robot whose hip plane is `height` metres above the centres of its feet."""
    masses, centres, inertias = [model.body_mass], [np.array(model.body_com)], [np.diag(model.body_inertia)]
    angles = inverse(nominal_feet(height, model), model).joints.tolist()
    for leg, ((hip_x, hip_y), side) in enumerate(zip(model.hips, model.sides, strict=True)):
        q1, q2, q3 = angles[3 * leg : 3 * leg + 3]
        hip, origin = _about_x(q1), np.array((hip_x, hip_y, 0.0))
        thigh = hip @ _about_y(q2)
        calf = thigh @ _about_y(q3)
        shoulder = origin + hip @ np.array((0.0, side * model.abduction, 0.0))
        knee = shoulder + thigh @ np.array((0.0, 0.0, -model.thigh))
        hip_com = np.array(
            (model.hip_com[0] if hip_x > 0.0 else -model.hip_com[0], model.hip_com[1] * side, model.hip_com[2])
        )
        masses += [model.hip_mass, model.thigh_mass, model.calf_mass]
        centres += [
            origin + hip @ hip_com,
            shoulder + thigh @ np.array(model.thigh_com),
            knee + calf @ np.array(model.calf_com),
        ]
        links = ((hip, model.hip_inertia), (thigh, model.thigh_inertia), (calf, model.calf_inertia))
        inertias += [turn @ np.diag(inertia) @ turn.T for turn, inertia in links]
    middle = sum((mass * centre for mass, centre in zip(masses, centres, strict=True)), np.zeros(3)) / model.mass
    whole = np.zeros((3, 3))
    for mass, centre, inertia in zip(masses, centres, inertias, strict=True):
        arm = centre - middle
        whole += inertia + mass * (arm.dot(arm) * np.eye(3) - np.outer(arm, arm))
    roll, pitch, yaw = np.diag(whole).tolist()
    return StandingMass(-float(middle[0]), (roll, pitch, yaw))


def _about_x(angle: float) -> Vector:
    c, s = np.cos(angle), np.sin(angle)
    return np.array(((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)))


def _about_y(angle: float) -> Vector:
    c, s = np.cos(angle), np.sin(angle)
    return np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))
