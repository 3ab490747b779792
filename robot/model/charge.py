"""What the charge of the battery means for the robot: its levels, and where they begin. All code that decides by the charge takes them from here."""

from __future__ import annotations

from enum import StrEnum

LOW, RESERVE, CRITICAL, HYSTERESIS = 0.30, 0.20, 0.10, 0.03
"""Shares of the coulomb count. Below `RESERVE` no goal but the dock is open; a level is left `HYSTERESIS` above where it begins."""


class ChargeLevel(StrEnum):
    """The robot's own judgement of its charge; not the `health_status` of the voltage gauge, whose borders differ."""

    GOOD = "good"
    LOW = "low"
    """Below 30 %: finish the goal only if the energy for it and for the way home is there, else dock."""
    CRITICAL = "critical"
    """Below 10 %, or below 10.0 V for 2 s: stop, sit, motors off, refuse to walk."""
