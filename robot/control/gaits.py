"""Which foot stands when: gaits as a table of phase offsets, and the clock that runs through them.

Each leg has the phase frac(t / period + offset). It stands while the phase is below `duty` and swings for the rest.
Offsets in the order fl, fr, rl, rr; names and phases are those of Hildebrand (1965)
and Alexander (1984), see docs/concepts/control.md#gaits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType

from robot.control.command import CommandLimits
from robot.model.robot import SPOT, RobotModel


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
    sway: tuple[float, float] | None = None
    """How far forward the ground's forces balance while a rear foot steps, and how far to the side while the feet of the other side do,
    m (`robot.control.sway`)."""
    sway_from: float = 0.0
    """The phase in the middle of the time between the left feet's steps and the right feet's: the body is on its way to the left then."""
    most: CommandLimits | None = None
    """Speeds that the gait is good for; None: all that the robot may be asked for."""
    entry: CommandLimits | None = None
    """Speeds at which it can be begun, and from which on it grows faster within one period; None: `most`."""

    def of(self, model: RobotModel) -> Gait:
        """This gait of the reference body, for another one: the same steps, at the same Froude numbers."""
        length, speed = model.length, model.speed
        return replace(
            self,
            period=self.period * speed,
            shortest=self.shortest * speed,
            clearance=self.clearance * length,
            hurry=(self.hurry[0] * speed, self.hurry[1] * speed),
            sway=None if self.sway is None else (self.sway[0] * length, self.sway[1] * length),
            most=None if self.most is None else self.most.of(model),
            entry=None if self.entry is None else self.entry.of(model),
        )


GAITS = MappingProxyType(
    {
        gait.name: gait
        for gait in (
            Gait("trot", 0.50, 0.52, (0.0, 0.5, 0.5, 0.0)),
            Gait(
                "crawl",
                1.0,
                0.80,
                (0.0, 0.5, 0.25, 0.75),
                shortest=0.7,
                hurry=(0.2, 0.5),
                sway=(0.04, 0.06),
                sway_from=0.025,
                most=CommandLimits(forward=0.5, backward=0.2, sideways=0.1, turn=0.5),
                entry=CommandLimits(forward=0.1, backward=0.05, sideways=0.03, turn=0.1),
            ),
            Gait("pace", 0.40, 0.55, (0.0, 0.5, 0.0, 0.5), most=CommandLimits(forward=1.6)),
            Gait(
                "bound",
                0.35,
                0.55,
                (0.0, 0.0, 0.5, 0.5),
                shortest=0.3,
                most=CommandLimits(forward=0.9, sideways=0.3, turn=1.0),
                entry=CommandLimits(forward=0.3, backward=0.2, sideways=0.1, turn=0.5),
            ),
            Gait(
                "pronk",
                0.35,
                0.60,
                (0.0, 0.0, 0.0, 0.0),
                shortest=0.3,
                most=CommandLimits(forward=1.2, backward=0.3, sideways=0.15, turn=1.0),
                entry=CommandLimits(forward=0.2, backward=0.2, sideways=0.1, turn=0.5),
            ),
        )
    }
)


@lru_cache(maxsize=16)
def gaits_of(model: RobotModel) -> Mapping[str, Gait]:
    """All gaits by name, as a robot walks them."""
    return (
        GAITS
        if model is SPOT
        else MappingProxyType({name: replace(gait.of(model), **model.tuned(name)) for name, gait in GAITS.items()})
    )


def gait_named(name: str, model: RobotModel = SPOT) -> Gait:
    """The gait of that name. Raises `ValueError` when there is none."""
    if name not in GAITS:
        raise ValueError(f"There is no gait {name!r}: choose one of {', '.join(sorted(GAITS))}.")
    return gaits_of(model)[name]


LEAD_IN = 0.02
"""Share of the period for which all feet stand when a gait begins; chosen: the forces settle before the first foot lifts."""


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

    def restart(self, gait: Gait | None = None, first: int | None = None, settle: float = 0.0) -> None:
        """Begin where all feet may still stand: the next to lift does so after a little of the first stance.

        `first` is the leg that is to lift first; without one the pattern decides. It waits `settle` seconds more than it would have to.
        """
        self.gait = gait or self.gait
        self.period = self.gait.period
        lifts = [(self.gait.duty - offset) % 1.0 for offset in self.gait.offsets]
        self.phase = ((min(lifts) if first is None else lifts[first]) - LEAD_IN - settle / self.period) % 1.0

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
