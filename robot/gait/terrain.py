"""The plane under the robot, fitted through the places its feet stood on last."""

from __future__ import annotations

from math import exp

import numpy as np

from robot.world.body import Vector

__all__ = ["TerrainPlane"]

STEEPEST = 0.6
SETTLE = 0.25
"""Time constant (s) with which the plane follows the feet."""


class TerrainPlane:
    """The slope of the ground along odom x and y (rise per metre), low-passed and bounded to 0.6."""

    def __init__(self) -> None:
        self.slope_x = 0.0
        self.slope_y = 0.0

    def update(self, dt: float, contacts: Vector) -> None:
        """Fit through the last contact point of each foot, shape (4, 3), odom axes, metres; least squares."""
        mean = contacts.mean(axis=0)
        away = contacts - mean
        xx, yy, xy = float(away[:, 0] @ away[:, 0]), float(away[:, 1] @ away[:, 1]), float(away[:, 0] @ away[:, 1])
        xz, yz = float(away[:, 0] @ away[:, 2]), float(away[:, 1] @ away[:, 2])
        determinant = xx * yy - xy * xy
        if determinant < 1e-4:
            return
        blend = 1.0 - exp(-dt / SETTLE)
        slope_x = max(-STEEPEST, min(STEEPEST, (xz * yy - yz * xy) / determinant))
        slope_y = max(-STEEPEST, min(STEEPEST, (yz * xx - xz * xy) / determinant))
        self.slope_x += blend * (slope_x - self.slope_x)
        self.slope_y += blend * (slope_y - self.slope_y)

    def flatten(self) -> None:
        """Forget the slope."""
        self.slope_x = self.slope_y = 0.0

    def normal(self) -> Vector:
        """The unit normal of the plane, odom axes."""
        normal = np.array([-self.slope_x, -self.slope_y, 1.0])
        return np.asarray(normal / np.linalg.norm(normal), dtype=np.float64)
