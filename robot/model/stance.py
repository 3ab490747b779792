"""Where the feet stand: the nominal stance that sitting, standing and walking share."""

from __future__ import annotations

import numpy as np

from robot.geometry.vectors import Vector
from robot.model.robot import SPOT, RobotModel

NOMINAL = SPOT.nominal
"""Of the reference body: foot places (x, y) in the body frame straight below the shoulders, order fl, fr, rl, rr, metres."""


def nominal_feet(height: float, model: RobotModel = SPOT) -> Vector:
    """The four foot centres in the body frame with the hip plane `height` metres above them, shape (4, 3)."""
    return np.array([(x, y, -height) for x, y in model.nominal])
