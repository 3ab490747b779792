"""From what the body should do to what the feet push: the body wrench, and its distribution over the standing feet."""

from __future__ import annotations

from collections.abc import Sequence

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
"""Horizontal force a foot may ask for, per vertical force."""

_UNIT = np.eye(3)


def distribute(arms: Sequence[Triple], wrench: Vector) -> Vector:
    """Ground forces (n, 3) at contact points `arms` (from the centre of mass) that best give `wrench` (force, moment about it).

    Regularised least squares, then clipped to the friction pyramid. Axes: any, z vertical. Units N and m.
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
    flat: list[float] = np.linalg.solve(normal, weighed @ wrench).tolist()
    for foot in range(count):
        x, y, z = flat[3 * foot : 3 * foot + 3]
        z = max(LEAST, min(MOST, z))
        grip = FRICTION * z
        flat[3 * foot : 3 * foot + 3] = max(-grip, min(grip, x)), max(-grip, min(grip, y)), z
    return np.array(flat).reshape(count, 3)
