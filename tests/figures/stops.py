"""Whether the robot ever falls because of us: what stops a walk, at every phase of the stride and every speed, and sensors that fail.

`python -m tests.figures stops`. Each row is so many robots that walk in physics, with sensors and drives as they are, and meet one cause; it tells how many
fell, and within which time the others knew of it.
"""

from __future__ import annotations

import statistics
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cli.command import UsageError
from robot.run.arguments import within
from tests.figures.fidelity import IDEAL, Fidelity, add_fidelity
from tests.figures.measurement import Measurement, Result, heading
from tests.figures.stops_run import CAUSES, FAULTY, Case, Outcome, run
from tests.figures.trials import add_trials, each

SPEEDS: Final = (0.3, 0.6, 1.0, 1.3, 1.6)
"""m/s forward; the last is the limit of cmd_vel."""
PHASES: Final = 32
FAULT_SPEEDS: Final = (1.0, 1.6)
DRAWS: Final = 200
"""Of sensor faults, over both speeds."""
MOST_TURN: Final = 0.5
"""Of a robot whose sensors fail, rad/s."""
KNOWN_WITHIN: Final = 0.5
"""Seconds within which a sensor that fails has to be found."""


@dataclass(frozen=True, slots=True)
class Row:
    """Cases that are counted together."""

    name: str
    cases: tuple[Case, ...]
    within: float | None
    """Seconds within which each has to be known; None: whenever."""


def rows(
    seed: int, delay: float, *, phases: int = PHASES, draws: int = DRAWS, fidelity: Fidelity = IDEAL
) -> tuple[Row, ...]:
    """All of them, for a motor delay in s. No case depends on another, nor on how many there are."""
    stops = [
        Row(
            f"{cause}, {speed:g} m/s",
            tuple(Case(cause, speed, number / phases, seed, delay, fidelity=fidelity) for number in range(phases)),
            None,
        )
        for cause in CAUSES
        for speed in SPEEDS
    ]
    faults = [
        Row(
            f"sensor faults, {speed:g} m/s",
            tuple(_drawn(seed, delay, speed, number, fidelity) for number in range(draws // len(FAULT_SPEEDS))),
            KNOWN_WITHIN,
        )
        for speed in FAULT_SPEEDS
    ]
    return (*stops, *faults)


def _drawn(seed: int, delay: float, speed: float, number: int, fidelity: Fidelity) -> Case:
    """A fault at a random moment of a walk with a random turn. Faults take turns, so that each has its share."""
    random = np.random.default_rng([seed, number, round(1000 * speed)])
    names = sorted(FAULTY)
    turn = float(random.uniform(-MOST_TURN, MOST_TURN))
    return Case(names[number % len(names)], speed, float(random.uniform()), seed, delay, turn, fidelity=fidelity)


# -- measuring --------------------------------------------------------------------------------------------------------


def measure(chosen: Sequence[Row], jobs: int, file: Path | None) -> list[dict[str, Any]]:
    """Run what `file` has not kept; says on stderr how far it is. One dict that JSON can hold for each row."""
    told: list[dict[str, Any]] = []
    cases = [case for row in chosen for case in row.cases]
    with closing(each(_run, cases, jobs=jobs, file=file, what="stops", name=asdict)) as outcomes:
        for number, row in enumerate(chosen, start=1):
            began = time.monotonic()
            told.append(_told(row, [(case, Outcome(**next(outcomes))) for case in row.cases]))
            seconds = time.monotonic() - began
            print(f"[{number}/{len(chosen)}] {_line(told[-1])} ({seconds:.0f} s)", file=sys.stderr, flush=True)
    return told


def _run(case: Case) -> dict[str, Any]:
    return asdict(run(case))


def _told(row: Row, met: Sequence[tuple[Case, Outcome]]) -> dict[str, Any]:
    times = [outcome.found for _, outcome in met if outcome.found is not None]
    late = [
        (case, outcome)
        for case, outcome in met
        if row.within is not None and (outcome.found is None or outcome.found > row.within)
    ]
    return {
        "name": row.name,
        "trials": len(met),
        "falls": sum(outcome.fallen for _, outcome in met),
        "known_median": statistics.median(times) if times else None,
        "known_worst": max(times, default=None),
        "never_known": len(met) - len(times),
        "known_late": len(late),
        "fallen": [asdict(case) | {"detail": outcome.detail} for case, outcome in met if outcome.fallen],
        "late": [asdict(case) | {"detail": outcome.detail, "known": outcome.found} for case, outcome in late],
    }


# -- telling ----------------------------------------------------------------------------------------------------------


def show(result: Mapping[str, Any]) -> str:
    """What `measure` gave, as text."""
    told = result["rows"]
    return "\n".join(
        [
            f"stops and sensor faults, motor delay {result['delay_ms']:g} ms, sensors {result['sensors']}, actuators {result['actuators']}, "
            f"seed {result['seed']}, back end physics",
            heading(result),
            "",
            f"{'cause':<32}{'falls':>10}{'known, median':>16}{'worst':>9}{'never':>7}{'late':>6}",
            *(_line(row) for row in told),
            "",
            f"falls: {sum(row['falls'] for row in told)} of {sum(row['trials'] for row in told)}; known: seconds after the cause",
        ]
    )


def _line(row: Mapping[str, Any]) -> str:
    def seconds(value: float | None) -> str:
        return "-" if value is None else f"{value:.3f}"

    falls = f"{row['falls']} / {row['trials']}"
    return (
        f"{row['name']:<32}{falls:>10}{seconds(row['known_median']):>16}{seconds(row['known_worst']):>9}"
        f"{row['never_known']:>7}{row['known_late']:>6}"
    )


# -- the command ------------------------------------------------------------------------------------------------------


def _take(asked: Namespace) -> Result:
    size: dict[str, Any] = {"phases": 4, "draws": 40} if asked.quick else {}
    fidelity = Fidelity.of(asked)
    every = rows(asked.seed, asked.delay / 1000.0, fidelity=fidelity, **size)
    chosen = [row for row in every if asked.only in row.name]
    if not chosen:
        raise UsageError(
            f"--only {asked.only}: no row's name contains that; there are: {', '.join(row.name for row in every)}"
        )
    told = measure(chosen, asked.jobs, asked.resume)
    values = {"backend": "physics", "seed": asked.seed, **fidelity.told, "delay_ms": asked.delay, "rows": told}
    return Result(values, show, not any(row["falls"] or row["known_late"] for row in told))


def _arguments(parser: ArgumentParser) -> None:
    add_trials(parser, quick="4 phases a row instead of 32, 40 sensor faults instead of 200", seed="of all robots")
    parser.add_argument("--only", default="", help="only rows whose name contains this")
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=8.0, help="motor delay, ms")
    add_fidelity(parser)


MEASUREMENT = Measurement(
    "stops",
    "what stops a walk, at every phase and speed, and sensors that fail: falls, and how soon each is known",
    "half an hour on an idle core",
    _arguments,
    _take,
)
