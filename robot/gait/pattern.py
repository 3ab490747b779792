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
    """One pattern. Periods in s; `duty` is the share of a period that each foot stands; `clearance` is how high feet go, m.

    Between the speeds of `hurry` (m/s) the period goes from `period` to `shortest`: long steps would leave the legs' reach, and
    a robot that is pushed must step soon.
    """

    name: str
    period: float
    duty: float
    offsets: tuple[float, float, float, float]
    clearance: float = 0.06
    shortest: float = 0.35
    hurry: tuple[float, float] = (1.0, 1.6)


GAITS = MappingProxyType(
    {
        gait.name: gait
        for gait in (
            Gait("trot", 0.50, 0.52, (0.0, 0.5, 0.5, 0.0)),
            Gait("crawl", 1.0, 0.80, (0.0, 0.5, 0.75, 0.25), shortest=0.8),
            Gait("pace", 0.40, 0.55, (0.0, 0.5, 0.0, 0.5)),
            Gait("bound", 0.35, 0.55, (0.0, 0.0, 0.5, 0.5), shortest=0.3),
        )
    }
)


class GaitClock:
    """Runs through a gait: tells each leg's phase, its stance and its progress through a swing."""

    def __init__(self, gait: Gait) -> None:
        self.gait = gait
        self.period = gait.period
        self.phase = 0.0
        """Of the leg with offset 0, in [0, 1)."""

    @property
    def stance_time(self) -> float:
        return self.gait.duty * self.period

    @property
    def swing_time(self) -> float:
        return (1.0 - self.gait.duty) * self.period

    def restart(self, gait: Gait | None = None) -> None:
        """Begin where all feet may still stand: the next to lift does so after a little of the first stance."""
        self.gait = gait or self.gait
        self.period = self.gait.period
        self.phase = (min((self.gait.duty - offset) % 1.0 for offset in self.gait.offsets) - 0.02) % 1.0

    def hurry(self, speed: float) -> None:
        """Choose the period for a speed (m/s)."""
        slow, fast = self.gait.hurry
        share = max(0.0, min(1.0, (speed - slow) / (fast - slow)))
        self.period = self.gait.period + (self.gait.shortest - self.gait.period) * share

    def advance(self, dt: float) -> None:
        self.phase = (self.phase + dt / self.period) % 1.0

    def leg_phase(self, leg: int, ahead: float = 0.0) -> float:
        """The phase of one leg `ahead` seconds from now, in [0, 1)."""
        return (self.phase + self.gait.offsets[leg] + ahead / self.period) % 1.0

    def swing(self, leg: int, ahead: float = 0.0) -> float:
        """Progress of the swing, 0 to 1; negative while the leg stands."""
        phase = self.leg_phase(leg, ahead)
        duty = self.gait.duty
        return (phase - duty) / (1.0 - duty) if phase >= duty else -1.0
