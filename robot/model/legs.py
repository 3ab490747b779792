"""What the four legs are at given joint angles: feet, Jacobians, the robot's centre of mass, the torques of the links' weight.

One pass in plain floats: this runs at every control step, and arrays of three numbers would cost several times as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import NamedTuple

from robot.geometry.vectors import Rows, Triple
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, RobotModel

LEVEL: Triple = (0.0, 0.0, 1.0)
"""The vertical of a level body, body axes."""


class LegState(NamedTuple):
    """Four legs at one instant, body axes, legs in order fl, fr, rl, rr."""

    feet: list[Triple]
    """Foot centres in the body frame, m."""
    jacobians: list[Rows]
    """Per leg: rows x, y, z against hip, shoulder, knee, m/rad."""
    centre: Triple
    """Centre of mass of the whole robot in the body frame, m."""
    weight: list[float]
    """The 12 joint torques that carry the links against gravity, N m."""
    model: RobotModel
    """Whose legs they are."""


def leg_state(angles: Sequence[float], up: Triple, model: RobotModel = SPOT) -> LegState:
    """The legs at 12 joint angles (rad); `up` is the world's vertical in body axes.

    Weight torques: minus the sum over the links of J_com^T (m g); see docs/concepts/control.md#legs.
    """
    feet: list[Triple] = []
    jacobians: list[Rows] = []
    weight: list[float] = []
    thigh, calf, abduction = model.thigh, model.calf, model.abduction
    hip_mass, thigh_mass, calf_mass, mass = model.hip_mass, model.thigh_mass, model.calf_mass, model.mass
    thigh_point, calf_point, (hip_ahead, hip_aside, _) = -model.thigh_com[2], -model.calf_com[2], model.hip_com
    mx, my, mz = (model.body_mass * part for part in model.body_com)
    up_x, up_y, up_z = up
    hip_pull, thigh_pull, calf_pull = hip_mass * GRAVITY, thigh_mass * GRAVITY, calf_mass * GRAVITY
    for leg, ((hip_x, hip_y), side) in enumerate(zip(model.hips, model.sides, strict=True)):
        offset = side * abduction
        q1, q2, q3 = angles[3 * leg : 3 * leg + 3]
        s1, c1, s2, c2 = sin(q1), cos(q1), sin(q2), cos(q2)
        s23, c23 = sin(q2 + q3), cos(q2 + q3)
        calf_x, calf_z = calf * s23, calf * c23
        x, height = -thigh * s2 - calf_x, -thigh * c2 - calf_z
        y, z = offset * c1 - height * s1, offset * s1 + height * c1
        feet.append((hip_x + x, hip_y + y, z))
        jacobians.append(((0.0, height, -calf_z), (-z, x * s1, -calf_x * s1), (y, -x * c1, calf_x * c1)))

        thigh_x, thigh_h = -thigh_point * s2, -thigh_point * c2
        shin_x, shin_z = calf_point * s23, calf_point * c23
        point_x, point_h = -thigh * s2 - shin_x, -thigh * c2 - shin_z
        thigh_y, thigh_z = offset * c1 - thigh_h * s1, offset * s1 + thigh_h * c1
        point_y, point_z = offset * c1 - point_h * s1, offset * s1 + point_h * c1
        lean = hip_ahead if hip_x > 0.0 else -hip_ahead
        hip_side = hip_aside * side
        mx += hip_mass * (hip_x + lean) + thigh_mass * (hip_x + thigh_x) + calf_mass * (hip_x + point_x)
        my += hip_mass * (hip_y + hip_side * c1) + thigh_mass * (hip_y + thigh_y) + calf_mass * (hip_y + point_y)
        mz += hip_mass * hip_side * s1 + thigh_mass * thigh_z + calf_mass * point_z
        sideways = s1 * up_y - c1 * up_z
        weight.append(
            thigh_pull * (thigh_y * up_z - thigh_z * up_y)
            + calf_pull * (point_y * up_z - point_z * up_y)
            + hip_pull * hip_side * (c1 * up_z - s1 * up_y)
        )
        weight.append(
            thigh_pull * (thigh_h * up_x + thigh_x * sideways) + calf_pull * (point_h * up_x + point_x * sideways)
        )
        weight.append(calf_pull * (-shin_z * up_x - shin_x * sideways))
    return LegState(feet, jacobians, (mx / mass, my / mass, mz / mass), weight, model)


def torques(jacobian: Rows, fx: float, fy: float, fz: float) -> Triple:
    """The joint torques -J^T f of one leg whose foot is pushed by the force (fx, fy, fz), body axes, N."""
    (_, xb, xc), (ya, yb, yc), (za, zb, zc) = jacobian
    return (-(ya * fy + za * fz), -(xb * fx + yb * fy + zb * fz), -(xc * fx + yc * fy + zc * fz))


def foot_velocities(
    now: LegState, angles: Sequence[float], speeds: Sequence[float], turn: Triple, up: Triple
) -> tuple[list[Triple], list[Triple]]:
    """Velocity of each foot's centre as seen from the body, and what of it is rolling, if the foot stands; m/s, body axes.

    The first includes the body's own angular velocity `turn` (rad/s): J qd + w x p. The second is the velocity of the centre
    of a ball that rolls on its contact point, w_calf x (rf up): a standing foot's centre is not at rest. Leaving it out is
    worth several per cent of the distance walked (docs/concepts/control.md#legs).
    """
    wx, wy, wz = turn
    moving: list[Triple] = []
    rolling: list[Triple] = []
    radius = now.model.foot_radius
    rx, ry, rz = radius * up[0], radius * up[1], radius * up[2]
    for leg in range(4):
        a, b, c = speeds[3 * leg : 3 * leg + 3]
        (_, xb, xc), (ya, yb, yc), (za, zb, zc) = now.jacobians[leg]
        x, y, z = now.feet[leg]
        moving.append(
            (
                xb * b + xc * c + wy * z - wz * y,
                ya * a + yb * b + yc * c + wz * x - wx * z,
                za * a + zb * b + zc * c + wx * y - wy * x,
            )
        )
        bend, hip = b + c, angles[3 * leg]
        cx, cy, cz = wx + a, wy + bend * cos(hip), wz + bend * sin(hip)
        rolling.append((cy * rz - cz * ry, cz * rx - cx * rz, cx * ry - cy * rx))
    return moving, rolling
