"""Slippery floors: friction of 0.2 all the way, and ice that begins under a walking robot. Does it fall?

`python -m tests.figures slip`. Gait controller and physics, sensors and drives as they are; the ice begins at another moment of the stride for every
seed. A robot may go on, or sit down: then it slid for a while. Whatever happens, it must not fall.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from cli.command import UsageError
from robot.run.arguments import whole, within
from robot.sim.ground import Ice
from robot.testing import Trial
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.measurement import Measurement, Result, heading
from tests.figures.trials import add_trials, each

TRIALS: Final = 20
AFTER: Final = 5.0
"""For so long a robot is looked at once it is on the floor in question at its speed, s: one that sits down takes 1.2."""
ACCELERATION: Final = 1.5
"""Of a robot that begins to walk, m/s2 (`CommandLimits.slew`)."""
NEAREST, FARTHEST = 0.5, 1.5
"""Where the ice begins, m from where the robot has reached its speed."""
ENDLESS: Final = 1000.0
"""Length of the ice, m."""


@dataclass(frozen=True, slots=True)
class Floor:
    """What is walked on, and how fast."""

    name: str
    speed: float
    """Asked for, m/s forward."""
    friction: float = 0.8
    ice: float | None = None
    """Friction from somewhere on; None: the same everywhere."""


FLOORS: Final = (
    Floor("friction 0.8", 1.6),
    *(Floor("friction 0.2", speed, friction=0.2) for speed in (0.6, 1.6)),
    *(Floor("ice of 0.1", speed, ice=0.1) for speed in (0.3, 0.6, 1.0, 1.3, 1.6)),
)
"""On the first nobody should sit down."""


def run(case: tuple[int, int], fidelity: Fidelity, delay: float) -> dict[str, Any]:
    """One robot, as JSON can hold what became of it; `case` is the floor's number and the seed, `delay` that of the motors, s."""
    number, seed = case
    floor = FLOORS[number]
    reached = floor.speed / ACCELERATION
    begins = 0.5 * floor.speed * reached + float(np.random.default_rng([seed, number]).uniform(NEAREST, FARTHEST))
    ice = Ice(floor.ice, begins, begins + ENDLESS) if floor.ice is not None else None
    trial = Trial(seed, conditions=fidelity.conditions(delay, friction=floor.friction, ice=ice))
    trial.stand_up()
    record = trial.run(begins / floor.speed + reached + AFTER, (floor.speed, 0.0, 0.0))
    tilt = float(np.degrees(record.tilt.max())) if len(record.tilt) else 0.0
    return {"fallen": trial.fallen, "sat": trial.gait.slips > 0, "tilt": tilt, "walked": record.distance}


def rows(outcomes: Mapping[tuple[int, int], Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A line for each floor, as JSON can hold it."""
    told: list[dict[str, Any]] = []
    for number, floor in enumerate(FLOORS):
        met = {seed: outcome for (row, seed), outcome in outcomes.items() if row == number}
        if met:
            told.append(
                asdict(floor)
                | {
                    "trials": len(met),
                    "falls": sum(one["fallen"] for one in met.values()),
                    "sat": sum(one["sat"] for one in met.values()),
                    "tilt": max(one["tilt"] for one in met.values()),
                    "fallen": [seed for seed, one in met.items() if one["fallen"]],
                }
            )
    return told


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"slippery floors, motor delay {result['delay_ms']:g} ms, sensors {result['sensors']}, actuators {result['actuators']}, back end physics",
            heading(result, result["trials"]),
            "",
            f"{'floor':<16}{'m/s':>5}{'falls':>10}{'sat down':>10}{'most tilt':>12}",
            *(_line(row) for row in result["rows"]),
        ]
    )


def _line(row: Mapping[str, Any]) -> str:
    falls = f"{row['falls']} / {row['trials']}"
    return f"{row['name']:<16}{row['speed']:>5g}{falls:>10}{row['sat']:>10}{row['tilt']:>8.0f} deg"


def _take(asked: Namespace) -> Result:
    chosen = [number for number, floor in enumerate(FLOORS) if asked.only in floor.name]
    if not chosen:
        raise UsageError(
            f"--only {asked.only}: no floor is called so; there are: {', '.join(sorted({f.name for f in FLOORS}))}"
        )
    many, fidelity = asked.trials or (TRIALS // 10 if asked.quick else TRIALS), Fidelity.of(asked)
    cases = [(number, seed) for number in chosen for seed in range(asked.seed, asked.seed + many)]
    trial = partial(run, fidelity=fidelity, delay=asked.delay / 1000.0)
    outcomes: dict[tuple[int, int], Mapping[str, Any]] = {}
    with closing(
        each(trial, cases, jobs=asked.jobs, file=asked.resume, what=f"slip, delay {asked.delay:g} ms, {fidelity}")
    ) as results:
        for case, outcome in zip(cases, results, strict=True):
            outcomes[case] = outcome
            if case[1] == cases[-1][1]:
                print(_line(rows(outcomes)[-1]), file=sys.stderr, flush=True)
    table = rows(outcomes)
    told = {"delay_ms": asked.delay, "trials": many, "rows": table}
    values = {"backend": "physics", "seed": asked.seed, **fidelity.told, **told}
    return Result(values, show, not any(row["falls"] for row in table))


def _arguments(parser: ArgumentParser) -> None:
    add_trials(parser)
    parser.add_argument(
        "--trials", type=whole(1, 10000), metavar="N", help=f"how many seeds a floor (default {TRIALS})"
    )
    parser.add_argument("--only", default="", help="only floors whose name contains this")
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=8.0, help="motor delay, ms")
    add_fidelity(parser)


MEASUREMENT = Measurement(
    "slip",
    "friction of 0.2, and ice that begins under a walking robot: falls, and who sits down, in physics",
    "ten minutes on a core",
    _arguments,
    _take,
)
