"""The depth cameras: four of them, fixed to the trunk, that together see the floor all round from its sides to some three metres ahead.

Of its dense picture each delivers the pixels that lie evenly spread on a level floor, every time others, and a few rows up to where things hang.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import atan2, pi, radians
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """Where one sits in `base_link` (m), where it looks (rad, to the left), and how much it delivers."""

    name: str
    place: tuple[float, float, float]
    yaw: float
    floor: tuple[float, float, float]
    """Nearest and farthest row on a level floor, and the distance between two, m from the camera."""
    columns: int


CAMERAS: Final = (
    DepthCamera("front", (0.42, 0.0, 0.05), 0.0, (0.2, 3.2, 0.05), 64),
    DepthCamera("left", (0.0, 0.12, 0.05), pi / 2, (0.15, 1.65, 0.075), 36),
    DepthCamera("right", (0.0, -0.12, 0.05), -pi / 2, (0.15, 1.65, 0.075), 36),
    DepthCamera("rear", (-0.42, 0.0, 0.05), pi, (0.2, 1.7, 0.075), 36),
)
FARTHEST: Final = 4.0
"""Up to here there is a depth, m."""
PATTERNS: Final = 8
"""So many pictures deliver different pixels; then the first come again."""
_EYE: Final = 0.53
"""Height of a camera over the floor while the robot walks, m."""
_HALF_WIDTH: Final = radians(50.0)
_UP: Final = radians(25.0)
"""The highest row looks so far up."""
_ROWS_UP: Final = 12
"""Between the farthest row on the floor and the highest one."""


def _rows(camera: DepthCamera, shift: float) -> Floats:
    """Elevations, rad; `shift` is a share of the distance between two rows."""
    near, far, step = camera.floor
    low = -np.arctan2(_EYE, np.arange(near, far, step) + shift * step)
    high = np.linspace(-atan2(_EYE, far), _UP, _ROWS_UP)
    return np.concatenate([low, high + shift * (high[1] - high[0])])


@lru_cache(maxsize=PATTERNS)
def rays(pattern: int) -> Floats:
    """Unit vectors in `base_link` of all pixels of all cameras, one camera after the other, shape (n, 3), read-only."""
    shifts = np.random.default_rng([pattern, 31]).random((len(CAMERAS), 2)) - 0.5
    parts: list[Floats] = []
    for camera, (down, left) in zip(CAMERAS, shifts, strict=True):
        step = 2 * _HALF_WIDTH / camera.columns
        azimuths = camera.yaw + _HALF_WIDTH - step * (np.arange(camera.columns) + 0.5 + left)
        rows = _rows(camera, down)
        elevation: Floats = np.repeat(rows, len(azimuths))
        azimuth: Floats = np.tile(azimuths, len(rows))
        level = np.cos(elevation)
        parts.append(np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1))
    together = np.concatenate(parts)
    together.setflags(write=False)
    return together


@lru_cache(maxsize=1)
def camera_of() -> NDArray[np.intp]:
    """The camera of every ray, as its place in `CAMERAS`, read-only, shape (n,)."""
    counts = [camera.columns * len(_rows(camera, 0.0)) for camera in CAMERAS]
    owners = np.repeat(np.arange(len(CAMERAS)), counts)
    owners.setflags(write=False)
    return owners


@lru_cache(maxsize=1)
def eyes() -> Floats:
    """Where every ray begins in `base_link`, m, read-only, shape (n, 3)."""
    places = np.array([camera.place for camera in CAMERAS])[camera_of()]
    places.setflags(write=False)
    return places
