"""From what the body should do to what the feet push: the body wrench, and its distribution over the standing feet."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

import numpy as np

from robot.world.body import Vector

__all__ = ["distribute"]

Triple = tuple[float, float, float]

IMPORTANCE = np.array([1.0, 1.0, 3.0, 10.0, 10.0, 4.0]) ** 2
"""Squared weights of force x, y, z (N) and moment x, y, z (N m) in the least-squares fit."""
EFFORT = 1e-3
"""Weight of the forces themselves."""
LEAST, MOST = 10.0, 600.0
"""Bounds of a standing foot's vertical force, N."""
FRICTION = 0.6
"""Force along the ground that a foot may ask for, per force into it."""
STEEP_FRICTION = 0.3
"""How much more of it on a slope, per rise: who stands on a steep slope stands on a rough one."""

_UNIT = np.eye(3)


def distribute(arms: Sequence[Triple], wrench: Vector, slope: tuple[float, float] = (0.0, 0.0)) -> Vector:
    """Ground forces (n, 3) at contact points `arms` (from the centre of mass) that best give `wrench` (force, moment about it).

    Regularised least squares, then each force is bounded along the ground's normal and to the friction cone around it. Axes: any,
    z vertical; `slope` is the ground's rise per metre along x and y. Units N and m.
    """
    count = len(arms)
    fit = np.zeros((6, 3 * count))
    for foot, (x, y, z) in enumerate(arms):
        column = 3 * foot
        fit[:3, column : column + 3] = _UNIT
        fit[3, column + 1], fit[3, column + 2] = -z, y
        fit[4, column], fit[4, column + 2] = z, -x
        fit[5, column], fit[5, column + 1] = -y, x
    weighed = fit.T * IMPORTANCE
    normal = weighed @ fit
    normal.flat[:: 3 * count + 1] += EFFORT
    forces: list[list[float]] = np.linalg.solve(normal, weighed @ wrench).reshape(count, 3).tolist()
    steepness = hypot(*slope)
    length = sqrt(1.0 + steepness * steepness)
    up = (-slope[0] / length, -slope[1] / length, 1.0 / length)
    grip = FRICTION + STEEP_FRICTION * steepness
    return np.array([_grip(force, up, grip) for force in forces])


def _grip(force: Sequence[float], up: Triple, friction: float) -> Triple:
    """The force, made one that a foot can give: it pushes, not too hard, and does not slide."""
    x, y, z = force
    ux, uy, uz = up
    pressing = x * ux + y * uy + z * uz
    x, y, z = x - pressing * ux, y - pressing * uy, z - pressing * uz
    pressing = max(LEAST, min(MOST, pressing))
    sideways = sqrt(x * x + y * y + z * z)
    scale = min(1.0, friction * pressing / sideways) if sideways > 0.0 else 1.0
    return (x * scale + pressing * ux, y * scale + pressing * uy, z * scale + pressing * uz)
