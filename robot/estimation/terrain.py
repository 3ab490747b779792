"""The plane under the robot, fitted through the last contact point of each foot (docs/concepts/control.md#terrain-plane)."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

from robot.geometry.vectors import Triple

STEEPEST = 0.6
IN_LINE = 1e-4
"""Feet whose second moments have a smaller determinant stand in a line, m4; chosen: the usual stance has 0.04."""
SETTLE = 0.25
"""Time constant of the low-pass on the slopes, s."""


def plane(feet: Sequence[Triple]) -> tuple[Triple, tuple[float, float] | None]:
    """The middle of four feet, and the slope (rise of z per metre along x and y) of the plane through them; least squares.

    None instead of a slope when they stand too much in one line to tell.
    """
    mx, my, mz = (sum(column) / 4 for column in zip(*feet, strict=True))
    xx = yy = xy = xz = yz = 0.0
    for fx, fy, fz in feet:
        x, y, z = fx - mx, fy - my, fz - mz
        xx += x * x
        yy += y * y
        xy += x * y
        xz += x * z
        yz += y * z
    determinant = xx * yy - xy * xy
    if determinant < IN_LINE:
        return (mx, my, mz), None
    return (mx, my, mz), ((xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant)


class TerrainPlane:
    """The ground as a plane: its slope along odom x and y (rise per metre), low-passed and bounded to 0.6, and its height."""

    def __init__(self) -> None:
        self.slope_x = 0.0
        self.slope_y = 0.0
        self._middle = (0.0, 0.0, 0.0)

    def update(self, dt: float, feet: Sequence[Triple]) -> None:
        """Fit through the last contact point of each of the four feet, odom axes, metres; least squares."""
        self._middle, slope = plane(feet)
        if slope is None:
            return
        blend = 1.0 - exp(-dt / SETTLE)
        slope_x = max(-STEEPEST, min(STEEPEST, slope[0]))
        slope_y = max(-STEEPEST, min(STEEPEST, slope[1]))
        self.slope_x += blend * (slope_x - self.slope_x)
        self.slope_y += blend * (slope_y - self.slope_y)

    def height(self, x: float, y: float) -> float:
        """Height (m) of a foot's centre on the plane at odom (x, y)."""
        mx, my, mz = self._middle
        return mz + self.slope_x * (x - mx) + self.slope_y * (y - my)
