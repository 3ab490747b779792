"""The concerns of the robot, and which of them may run on another machine."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

ELSEWHERE: Final = ("perception", "navigation", "mission")
"""Those that may: while one of them is away, the robot stands still."""
HERE: Final[Mapping[str, str]] = MappingProxyType(
    {
        "control": "control keeps the robot on its feet 200 times a second, and no network may stand between it and the motors",
        "safety": "safety stops the robot when the others are not heard, so it must not be cut off itself",
        "handling": "handling moves the arm, which is reached on the robot only",
    }
)
"""Those that may not, and why."""
