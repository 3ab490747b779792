"""Vectors: their types, and turning them from the body's axes into those of the ground and back, in plain floats."""

from __future__ import annotations

from math import tau

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""An array of any shape."""
Vector = NDArray[np.float64]
"""An array of one dimension, or a few of them stacked."""
Triple = tuple[float, float, float]
Rows = tuple[Triple, Triple, Triple]
"""A 3 x 3 matrix by its rows."""


def to_ground(rotation: Rows, vector: Triple) -> Triple:
    """R v: `rotation` is body to ground."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def to_body(rotation: Rows, vector: Triple) -> Triple:
    """R' v: `rotation` is body to ground."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)


def wrap_all(angles: Floats) -> Floats:
    """The same angles (rad) in [-pi, pi]."""
    return np.asarray(angles - tau * np.rint(angles / tau), dtype=np.float64)


def rotation_of(quaternion: Vector) -> Floats:
    """The matrix (3, 3) that turns as this quaternion (w, x, y, z) does, which need not have length 1."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion)).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
