"""Depth cameras as they are: noise that grows with the square of the distance, pixels without depth, pictures that are lost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from robot.geometry.vectors import Floats, Vector
from robot.hardware.depth import CAMERAS, FARTHEST, camera_of, eyes, rays
from robot.scenes.scene import Obstacle, Pit
from robot.scenes.terrain import Ramp
from robot.sim.depth_rays import sight

LATENCY: Final = 0.05
"""From a picture to its delivery, s."""
_SD, _SD_SQUARE = 0.003, 0.0025
"""Of a depth, m, and so much more per square metre of distance: that of stereo cameras with a base of 5 cm."""
_BLIND: Final = 0.05
"""Share of pixels without a depth."""
_LOST: Final = 0.02
"""Share of pictures that never come."""


class DepthNoise:
    """The errors of one robot's depth cameras. The same generator and the same calls give the same pictures."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator

    def apply(self, depths: Floats) -> Floats | None:
        """The depths as measured, NaN where there is none; None for a picture that is lost. inf is nothing within reach."""
        lost, draws, blind = (
            self._generator.random() < _LOST,
            self._generator.standard_normal(len(depths)),
            self._generator.random(len(depths)) < _BLIND,
        )
        if lost:
            return None
        with np.errstate(invalid="ignore"):
            noisy = depths + (_SD + _SD_SQUARE * depths * depths) * draws
        noisy[blind | ~np.isfinite(depths)] = np.nan
        return noisy


def look(
    obstacles: Sequence[Obstacle],
    pits: Sequence[Pit],
    position: Vector,
    rotation: Floats,
    pattern: int,
    terrain: Sequence[Ramp] = (),
) -> Floats:
    """Exact depths of all pixels for a body there, m, inf for none; `rotation` (3, 3) turns body axes into the world's."""
    directions = rays(pattern) @ rotation.T
    depths = np.empty(len(directions))
    for number, camera in enumerate(CAMERAS):
        own = camera_of() == number
        eye = position + rotation @ np.array(camera.place)
        depths[own] = sight(obstacles, pits, eye, directions[own], FARTHEST, terrain)
    return depths


def seen(depths: Floats, pattern: int) -> Floats:
    """The points of measured depths in `base_link`, m, shape (n, 3), NaN where there is no depth."""
    return np.asarray(eyes() + rays(pattern) * depths[:, None], dtype=np.float64)
