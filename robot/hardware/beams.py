"""The LiDAR's beams: how many, how far, and which looks where."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats

BEAMS: Final = 360
MAX_RANGE: Final = 10.0
"""m; a beam that reads this has met nothing."""
NEAREST: Final = 0.05
"""m; a shorter range lies within the sensor's own housing."""
_ROUNDING = 1e-6
"""Of ranges on their way through a message's 32 bits, m."""


@lru_cache(maxsize=8)
def beam_angles(beams: int = BEAMS) -> Floats:
    """Angle of every beam in the sensor's frame, read-only, shape (beams,): beam i looks along -pi + i 2 pi / beams. A scan may be empty."""
    angles: Floats = -math.pi + np.arange(beams, dtype=np.float64) * (2 * math.pi / max(1, beams))
    angles.setflags(write=False)
    return angles


def returns(ranges: Floats, max_range: float = MAX_RANGE, nearest: float = NEAREST) -> NDArray[np.bool_]:
    """Which beams have met something farther than `nearest` (m); a range at or over the maximum, NaN and inf mean that they have not."""
    return np.isfinite(ranges) & (ranges > nearest) & (ranges < max_range - _ROUNDING)
