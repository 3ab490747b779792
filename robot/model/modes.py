"""What the robot does with its legs."""

from __future__ import annotations

from enum import StrEnum


class Mode(StrEnum):
    """Three that can be asked for, and three on the way between them."""

    SIT = "sit"
    RISING = "rising"
    STAND = "stand"
    WALK = "walk"
    STOPPING = "stopping"
    LOWERING = "lowering"


ON_ITS_FEET = (Mode.STAND, Mode.WALK, Mode.STOPPING)
"""Those in which nothing but feet should touch the floor."""
GOALS = (Mode.SIT, Mode.STAND, Mode.WALK)
"""Those that can be asked for."""
