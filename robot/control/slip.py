"""Feeling that the floor is ice: standing feet slide that were asked for little friction (docs/concepts/control.md#ice)."""

from __future__ import annotations

from math import exp, sqrt
from typing import Final

from robot.estimation.leg_odometry import FIRM
from robot.geometry.vectors import Triple

LITTLE: Final = 0.35
"""Friction, force along the ground per force into it; chosen: a floor that does not give so much is slippery."""
SLIDING: Final = 0.3
"""A foot that moves over the ground faster than this slides, m/s; chosen: feet on a floor of 0.8 stay below 0.2 at 1.6 m/s."""
GAP: Final = 0.02
"""A contact may be missed for so long, s: four samples."""
MEMORY: Final = 0.3
"""Time constant with which sliding is forgotten, s; chosen: a stride."""
CERTAIN: Final = 0.03
"""Seconds of sliding, of all feet together, from which on it is certain; chosen: pushes of 70 N s come to 0.02 on a floor of 0.8."""
UNHURRIED: Final = 0.7
"""A walk that is asked for no more than this, m/s, falls later on ice, and may be one over rubble."""
CERTAIN_THEN: Final = 0.08
"""What `CERTAIN` is for such a walk, s; measured: feet that slip off edges of rubble come to 0.06."""


class SlipWatch:
    """How long standing feet have slid lately that were asked for little friction.

    A floor that gives less than it was asked for may still be a good one: then the body was pushed. Invariant: what is remembered only falls
    while nothing slides.
    """

    def __init__(self) -> None:
        self._firm, self._gap = [0.0] * 4, [0.0] * 4
        """Seconds for which each foot has stood, and since it had contact."""
        self._asked = [1.0] * 4
        self._slid = 0.0

    def slippery(self, speed: float) -> bool:
        """Whether the floor is slippery, for a walk that is asked for `speed`, m/s."""
        return self._slid > (CERTAIN if speed > UNHURRIED else CERTAIN_THEN)

    def asked(self, leg: int, friction: float) -> None:
        """The leg is commanded to push so that its foot needs this friction."""
        self._asked[leg] = friction

    def forget(self, dt: float) -> None:
        """`dt` seconds pass."""
        self._slid *= exp(-dt / MEMORY)

    def feel(self, dt: float, leg: int, *, stands: bool, contact: bool, speed: float) -> None:
        """Of one foot in the last `dt` seconds: whether it is meant to stand, has contact, and how fast it moves over the ground, m/s."""
        self._firm[leg] = self._firm[leg] + dt if stands else 0.0
        self._gap[leg] = 0.0 if contact else self._gap[leg] + dt
        if self._firm[leg] > FIRM and self._gap[leg] < GAP and speed > SLIDING and self._asked[leg] < LITTLE:
            self._slid += dt


def friction_of(force: Triple, slope: tuple[float, float]) -> float:
    """Force along the ground per force into it; `slope` is the ground's rise per metre along x and y."""
    x, y, z = force
    pressing = (z - slope[0] * x - slope[1] * y) / sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
    return sqrt(max(0.0, x * x + y * y + z * z - pressing * pressing)) / pressing
