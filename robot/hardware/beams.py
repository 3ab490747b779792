"""The LiDAR's beams: how many, how far, and which looks where."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np

from robot.geometry.vectors import Floats

__all__ = ["BEAMS", "MAX_RANGE", "beam_angles"]

BEAMS: Final = 360
MAX_RANGE: Final = 10.0
"""m; a beam that reads this has met nothing."""


@lru_cache(maxsize=8)
def beam_angles(beams: int = BEAMS) -> Floats:
    """Angle of every beam in the sensor's frame, read-only, shape (beams,): beam i looks along -pi + i 2 pi / beams."""
    angles: Floats = -math.pi + np.arange(beams, dtype=np.float64) * (2 * math.pi / beams)
    angles.setflags(write=False)
    return angles
