"""Whether the robot ever falls because of us: what stops a walk, at every phase of the stride and every speed, and sensors that fail.

`python -m robot evaluate stops`. Each row is so many robots that walk in physics, with noisy sensors, and meet one cause; it tells how many
fell, and within which time the others knew of it.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import date
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np

from robot.evaluate.levels import machine
from robot.evaluate.stops_run import CAUSES, FAULTY, Case, Outcome, run
from robot.run.arguments import Parser, parse_seed, whole, within
from robot.run.errands import UsageError
from robot.sim.physics import BackendMissing, check_engine

__all__ = ["SPEEDS", "Row", "main", "measure", "rows", "show"]

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


def rows(seed: int, delay: float, *, phases: int = PHASES, draws: int = DRAWS) -> tuple[Row, ...]:
    """All of them, for a motor delay in s. No case depends on another, nor on how many there are."""
    stops = [
        Row(
            f"{cause}, {speed:g} m/s",
            tuple(Case(cause, speed, number / phases, seed, delay) for number in range(phases)),
            None,
        )
        for cause in CAUSES
        for speed in SPEEDS
    ]
    faults = [
        Row(
            f"sensor faults, {speed:g} m/s",
            tuple(_drawn(seed, delay, speed, number) for number in range(draws // len(FAULT_SPEEDS))),
            KNOWN_WITHIN,
        )
        for speed in FAULT_SPEEDS
    ]
    return (*stops, *faults)


def _drawn(seed: int, delay: float, speed: float, number: int) -> Case:
    """A fault at a random moment of a walk with a random turn. Faults take turns, so that each has its share."""
    random = np.random.default_rng([seed, number, round(1000 * speed)])
    names = sorted(FAULTY)
    turn = float(random.uniform(-MOST_TURN, MOST_TURN))
    return Case(names[number % len(names)], speed, float(random.uniform()), seed, delay, turn)


# -- measuring --------------------------------------------------------------------------------------------------------


def measure(
    chosen: Sequence[Row], jobs: int, done: Mapping[Case, Outcome], keep: Callable[[Case, Outcome], None]
) -> list[dict[str, Any]]:
    """Run what is not `done`, handing each outcome to `keep`; says on stderr how far it is. One dict that JSON can hold for each row."""
    told: list[dict[str, Any]] = []
    with _pool(jobs) as walk:
        outcomes = walk([case for row in chosen for case in row.cases if case not in done])
        for number, row in enumerate(chosen, start=1):
            began, met = time.perf_counter(), list[tuple[Case, Outcome]]()
            for case in row.cases:
                outcome = done.get(case)
                if outcome is None:
                    outcome = next(outcomes)
                    keep(case, outcome)
                met.append((case, outcome))
            told.append(_told(row, met))
            seconds = time.perf_counter() - began
            print(f"[{number}/{len(chosen)}] {_line(told[-1])} ({seconds:.0f} s)", file=sys.stderr, flush=True)
    return told


@contextmanager
def _pool(jobs: int) -> Generator[Callable[[Sequence[Case]], Iterator[Outcome]]]:
    """What runs many cases, in their order: in so many processes, or in this one."""
    if jobs == 1:
        yield lambda cases: map(run, cases)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield lambda cases: pool.map(run, cases)


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
    here, told = result["machine"], result["rows"]
    return "\n".join(
        [
            f"stops and sensor faults, motor delay {result['delay_ms']:g} ms, seed {result['seed']}, back end physics",
            f"{result['date']}; {here['processor']}, {here['cores']} cores, Python {here['python']}, MuJoCo {here['mujoco']}; "
            f"{result['seconds']:.0f} s",
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


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table; 0 without a fall and with every fault known in time, 1 otherwise, 3 without the physics back end. Raises `UsageError`."""
    parser = Parser(
        prog="python -m robot evaluate stops",
        description=(__doc__ or "").split("\n")[0],
        epilog="All of it takes half an hour on an idle core.",
    )
    parser.add_argument("--seed", type=parse_seed, default=1, help="of all robots (default 1)")
    parser.add_argument(
        "--quick", action="store_true", help="4 phases a row instead of 32, 40 sensor faults instead of 200"
    )
    parser.add_argument("--only", default="", help="only rows whose name contains this")
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=8.0, help="motor delay, ms")
    parser.add_argument("--jobs", type=whole(1, 256), default=1, metavar="N", help="processes (default 1)")
    parser.add_argument(
        "--resume", type=Path, metavar="FILE", help="keep each outcome here, and do not run again what is kept"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    asked = parser.parse_args(argv)
    try:
        check_engine()
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    size = {"phases": 4, "draws": 40} if asked.quick else {}
    every = rows(asked.seed, asked.delay / 1000.0, **size)
    chosen = [row for row in every if asked.only in row.name]
    if not chosen:
        raise UsageError(
            f"--only {asked.only}: no row's name contains that; there are: {', '.join(row.name for row in every)}"
        )
    began = time.perf_counter()
    done, keep = _kept(asked.resume)
    told = measure(chosen, asked.jobs, done, keep)
    result = {
        "backend": "physics", "seed": asked.seed, "delay_ms": asked.delay, "date": date.today().isoformat(),
        "seconds": time.perf_counter() - began, "machine": machine(), "rows": told,
    }  # fmt: skip
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 1 if any(row["falls"] or row["known_late"] for row in told) else 0


def _kept(file: Path | None) -> tuple[dict[Case, Outcome], Callable[[Case, Outcome], None]]:
    """What a file holds of an earlier run, a line of JSON each, and what adds to it. Raises `UsageError` for another kind of file."""
    done: dict[Case, Outcome] = {}
    if file is None:
        return done, lambda case, outcome: None
    try:
        for line in file.read_text().splitlines() if file.exists() else ():
            held = json.loads(line)
            done[Case(**held["case"])] = Outcome(**held["outcome"])
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise UsageError(f"--resume {file}: these are no outcomes of an earlier run: {error}") from error

    def keep(case: Case, outcome: Outcome) -> None:
        with file.open("a") as out:
            out.write(json.dumps({"case": asdict(case), "outcome": asdict(outcome)}) + "\n")

    return done, keep


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["stops", *sys.argv[1:]]))
