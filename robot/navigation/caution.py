"""How fast the robot may walk by what it sees of the floor, and knows of slopes."""

from __future__ import annotations

import math
from dataclasses import replace

from robot.navigation.limits import Limits
from robot.navigation.navigator_config import NavigatorConfig

_STEP = 0.05
"""Speeds are multiples of this, m/s: limits that change at every step would cost more than they bring."""
_ROUNDING = 1e-9
"""0.4 / 0.05 is no less than 8."""


def cautious_speed(limits: Limits, config: NavigatorConfig, seen: float, *, stepping: bool) -> Limits:
    """The limits with a highest speed at which the robot stops within the `seen` metres of floor ahead, and slow while it is `stepping`.

    v = sqrt(2 braking (seen - sight_room)), at least `groping_speed`, at most that of `limits`.
    """
    stops = math.sqrt(2.0 * config.braking * max(seen - config.sight_room, 0.0))
    return slower(limits, max(min(stops, config.step_speed) if stepping else stops, config.groping_speed))


def slower(limits: Limits, speed: float) -> Limits:
    """The limits with a highest speed of `speed` m/s, rounded down; those that are as slow stay."""
    if speed >= limits.vx_max:
        return limits
    return replace(limits, vx_max=max(_STEP, math.floor(speed / _STEP + _ROUNDING) * _STEP))
