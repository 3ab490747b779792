"""The plane under the robot, fitted through the places its feet stood on last."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from robot.gait.limbs import Triple

__all__ = ["TerrainPlane"]

STEEPEST = 0.6
SETTLE = 0.25
"""Time constant (s) with which the plane follows the feet."""


class TerrainPlane:
    """The ground as a plane: its slope along odom x and y (rise per metre), low-passed and bounded to 0.6, and its height."""

    def __init__(self) -> None:
        self.slope_x = 0.0
        self.slope_y = 0.0
        self._middle = (0.0, 0.0, 0.0)

    def update(self, dt: float, feet: Sequence[Triple]) -> None:
        """Fit through the last contact point of each of the four feet, odom axes, metres; least squares."""
        mx, my, mz = (0.25 * sum(column) for column in zip(*feet, strict=True))
        self._middle = (mx, my, mz)
        xx = yy = xy = xz = yz = 0.0
        for fx, fy, fz in feet:
            x, y, z = fx - mx, fy - my, fz - mz
            xx += x * x
            yy += y * y
            xy += x * y
            xz += x * z
            yz += y * z
        determinant = xx * yy - xy * xy
        if determinant < 1e-4:
            return
        blend = 1.0 - exp(-dt / SETTLE)
        slope_x = max(-STEEPEST, min(STEEPEST, (xz * yy - yz * xy) / determinant))
        slope_y = max(-STEEPEST, min(STEEPEST, (yz * xx - xz * xy) / determinant))
        self.slope_x += blend * (slope_x - self.slope_x)
        self.slope_y += blend * (slope_y - self.slope_y)

    def height(self, x: float, y: float) -> float:
        """Height (m) of a foot's centre on the plane at odom (x, y)."""
        mx, my, mz = self._middle
        return mz + self.slope_x * (x - mx) + self.slope_y * (y - my)
