"""Which foot stands when: gaits as a table of phase offsets, and the clock that runs through them.

Each leg has the phase frac(t / period + offset). It stands while the phase is below `duty` and swings for the rest.
Offsets in the order fl, fr, rl, rr; they follow the usual names (robot-domain section 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["GAITS", "Gait", "GaitClock"]


@dataclass(frozen=True, slots=True)
class Gait:
    """One pattern: its period (s), the share of it that each foot stands, each leg's offset, and how high feet are lifted (m)."""

    name: str
    period: float
    duty: float
    offsets: tuple[float, float, float, float]
    clearance: float = 0.08

    @property
    def stance_time(self) -> float:
        return self.duty * self.period

    @property
    def swing_time(self) -> float:
        return (1.0 - self.duty) * self.period


GAITS = MappingProxyType(
    {
        gait.name: gait
        for gait in (
            Gait("trot", 0.45, 0.55, (0.0, 0.5, 0.5, 0.0)),
            Gait("crawl", 1.0, 0.80, (0.0, 0.5, 0.75, 0.25)),
            Gait("pace", 0.40, 0.55, (0.0, 0.5, 0.0, 0.5)),
            Gait("bound", 0.35, 0.55, (0.0, 0.0, 0.5, 0.5)),
        )
    }
)


class GaitClock:
    """Runs through a gait: tells each leg's phase, its stance and its progress through a swing."""

    def __init__(self, gait: Gait) -> None:
        self.gait = gait
        self.phase = 0.0
        """Of the leg with offset 0, in [0, 1)."""

    def restart(self, gait: Gait | None = None) -> None:
        """Begin where all feet may still stand: the next to lift does so after a little of the first stance."""
        self.gait = gait or self.gait
        lifts = [(self.gait.duty - offset) % 1.0 for offset in self.gait.offsets]
        self.phase = (min(lift for lift in lifts) - 0.02) % 1.0

    def advance(self, dt: float) -> None:
        self.phase = (self.phase + dt / self.gait.period) % 1.0

    def leg_phase(self, leg: int, ahead: float = 0.0) -> float:
        """The phase of one leg `ahead` seconds from now, in [0, 1)."""
        return (self.phase + self.gait.offsets[leg] + ahead / self.gait.period) % 1.0

    def swing(self, leg: int, ahead: float = 0.0) -> float:
        """Progress of the swing, 0 to 1; negative while the leg stands."""
        phase = self.leg_phase(leg, ahead)
        duty = self.gait.duty
        return (phase - duty) / (1.0 - duty) if phase >= duty else -1.0
