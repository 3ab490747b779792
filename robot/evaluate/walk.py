"""How well the robot walks, measured on the physics back end and held against the ladder of acceptance metrics.

`python -m robot evaluate walk` or `python -m robot.evaluate.walk`. Every figure is the median over the seeds, with the least and
the largest. The closed loop is the robot's own: knee torque curve, motor delay, noisy sensors, estimator, 200 Hz control.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

from robot.evaluate import walk_measures as measure

__all__ = ["main", "run", "show"]

Ladder = tuple[float, float, float]

SMALLER, LARGER = "smaller", "larger"


def _rows(delay: float, minutes: float, quick: bool) -> list[tuple[str, str, str, Ladder, Callable[[int], float]]]:
    """Name, unit, which way is better, the ladder's three columns, and the measurement for one seed."""
    rows: list[tuple[str, str, str, Ladder, Callable[[int], float]]] = [
        ("speed rmse at 0.3 m/s", "m/s", SMALLER, (0.10, 0.05, 0.02), lambda s: measure.speed_error(s, delay, (0.3, 0, 0))),
        ("speed rmse at 0.6 m/s", "m/s", SMALLER, (0.10, 0.05, 0.02), lambda s: measure.speed_error(s, delay, (0.6, 0, 0))),
        ("speed rmse at 1.0 m/s", "m/s", SMALLER, (0.10, 0.05, 0.02), lambda s: measure.speed_error(s, delay, (1.0, 0, 0))),
        ("speed rmse at 1.6 m/s", "m/s", SMALLER, (0.20, 0.10, 0.05), lambda s: measure.speed_error(s, delay, (1.6, 0, 0))),
        ("yaw rate rmse at 1.0 rad/s", "rad/s", SMALLER, (0.10, 0.03, 0.01), lambda s: measure.speed_error(s, delay, (0, 0, 1.0))),
    ]
    return rows
