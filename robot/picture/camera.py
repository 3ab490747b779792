"""The eye: a pinhole that looks from one point to another. Pixel (0, 0) is the top left corner; pixel centres lie at halves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import radians, tan

import numpy as np

from robot.geometry.vectors import Vector
from robot.picture.solids import Floats


@dataclass(frozen=True, eq=False)
class Camera:
    """Looks from `eye` at `target`, z upwards; `field` is the height of the view in degrees; width and height are pixels."""

    eye: Vector
    target: Vector
    width: int
    height: int
    field: float = 40.0

    @cached_property
    def axes(self) -> Vector:
        """Right, down and forward as columns."""
        forward = self.target - self.eye
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        return np.column_stack((right, np.cross(forward, right), forward))

    @property
    def pixel(self) -> float:
        """The side of a pixel at distance 1 in the middle of the view."""
        return 2.0 * tan(radians(self.field) / 2.0) / self.height

    def rays(self, x: Floats, y: Floats) -> Floats:
        """Unit directions through image points, shape (3, n)."""
        across = (x - np.float32(self.width / 2.0)) * np.float32(self.pixel)
        down = (y - np.float32(self.height / 2.0)) * np.float32(self.pixel)
        rays = self.axes.astype(np.float32) @ np.stack((across, down, np.ones_like(across)))
        result: Floats = rays / np.sqrt((rays * rays).sum(axis=0))
        return result

    def project(self, point: Vector) -> tuple[float, float, float]:
        """The image point (x, y) of a world point, and its depth along the view, m (negative behind the eye)."""
        across, down, depth = (self.axes.T @ (point - self.eye)).tolist()
        scale = 1.0 / (depth * self.pixel)
        return self.width / 2.0 + across * scale, self.height / 2.0 + down * scale, depth
