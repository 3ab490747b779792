"""Whether the robot falls where endless loops share its only processor and nothing gives it real-time scheduling.

`python -m tests.figures busy`. The robot walks in physics in virtual time; when control runs comes from a model of the processor
(`tests.figures.turns`), so the figures do not depend on the machine. `tests.figures rates --loops` measures the same on a real one.
"""

from __future__ import annotations

import statistics
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

from robot.run.arguments import seconds, whole, within
from tests.figures.busy_run import Outcome, walk
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.measurement import Measurement, Result, heading
from tests.figures.trials import add_trials, each
from tests.figures.turns import Load

COSTS: Final = (0.0006, 0.0009, 0.0012)
"""Processor time of control for one sample, s: on an idle machine, and on one whose other processor is busy."""
ROBOTS: Final = 10
SECONDS: Final = 60.0


@dataclass(frozen=True, slots=True)
class Case:
    """One robot."""

    load: Load
    seed: int


def measure(loads: Sequence[Load], robots: int, long: float, fidelity: Fidelity, asked: Any) -> list[dict[str, Any]]:
    """One dict that JSON can hold for each load."""
    cases = [Case(load, asked.seed + number) for load in loads for number in range(robots)]
    what = f"busy, {long:g} s, delay {asked.delay:g} ms, {fidelity}"
    take = partial(_run, long=long, fidelity=fidelity, delay=asked.delay / 1000.0)
    told: list[dict[str, Any]] = []
    with closing(each(take, cases, jobs=asked.jobs, file=asked.resume, what=what, name=asdict)) as outcomes:
        for load in loads:
            told.append(_told(load, [Outcome(**next(outcomes)) for _ in range(robots)]))
            print(_line(told[-1]), file=sys.stderr, flush=True)
    return told


def _run(case: Case, long: float, fidelity: Fidelity, delay: float) -> dict[str, Any]:
    return asdict(walk(case.load, case.seed, long, fidelity, delay))


def _told(load: Load, met: Sequence[Outcome]) -> dict[str, Any]:
    return asdict(load) | {
        "robots": len(met),
        "falls": sum(one.fallen is not None for one in met),
        "age_median": statistics.median(one.age_median for one in met),
        "age_p99": max(one.age_p99 for one in met),
        "taken_over": sum(one.taken_over for one in met),
    }


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"beside endless loops, {result['seconds']:g} s each, motor delay {result['delay_ms']:g} ms, sensors {result['sensors']}, "
            f"actuators {result['actuators']}, back end physics",
            heading(result),
            "",
            f"{'loops':>5}{'control needs':>15}{'samples':>12}{'falls':>9}{'age, median':>13}{'worst p99':>11}{'taken over':>12}",
            *(_line(row) for row in result["rows"]),
            "",
            "age: of the newest sample when its targets are out; taken over: how often the drives acted by themselves",
        ]
    )


def _line(row: Mapping[str, Any]) -> str:
    falls = f"{row['falls']} / {row['robots']}"
    return (
        f"{row['loops']:>5}{1000 * row['control']:>12.1f} ms{'together' if row['together'] else 'one by one':>12}{falls:>9}"
        f"{1000 * row['age_median']:>10.1f} ms{1000 * row['age_p99']:>8.1f} ms{row['taken_over']:>12}"
    )


def _take(asked: Namespace) -> Result:
    robots, long = asked.robots or (2 if asked.quick else ROBOTS), asked.duration or (10.0 if asked.quick else SECONDS)
    loads = [Load(loops, cost, not asked.one_by_one) for loops in asked.loops for cost in COSTS]
    fidelity = Fidelity.of(asked)
    told = measure(loads, robots, long, fidelity, asked)
    how = {"seed": asked.seed, **fidelity.told, "delay_ms": asked.delay, "seconds": long}
    return Result({"backend": "physics", **how, "rows": told}, show, not any(row["falls"] for row in told))


def _arguments(parser: ArgumentParser) -> None:
    add_trials(parser, quick="2 robots of 10 s")
    parser.add_argument("--robots", type=whole(1, 1000), metavar="N", help=f"of each row (default {ROBOTS})")
    parser.add_argument("--duration", type=seconds, metavar="S", help=f"for which each walks (default {SECONDS:g})")
    parser.add_argument(
        "--loops", type=whole(0, 8), nargs="+", default=[1, 2], metavar="N", help="endless loops (default 1 2)"
    )
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=4.0, help="motor delay, ms")
    parser.add_argument(
        "--one-by-one",
        action="store_true",
        help="let control take each sample by itself, however late: what it did before",
    )
    add_fidelity(parser)


MEASUREMENT = Measurement(
    "busy",
    "walking while endless loops share the only processor, without real-time scheduling: falls, in virtual time",
    "a quarter of an hour on an idle core",
    _arguments,
    _take,
)
