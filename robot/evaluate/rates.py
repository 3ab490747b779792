"""The whole robot on the real clock: the rate of every stream, how punctual its control loop is, and its share of a processor core.

`python -m robot evaluate rates`. Somebody listens to every sensor, the camera included. What is measured is this machine as it is now: run
it on an idle one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

from robot.evaluate.levels import Metric, conclude, measure, parser
from robot.evaluate.rates_run import STREAMS, TIMERS, Punctuality, Run, run_loop, run_robot
from robot.evaluate.rates_split import run_split
from robot.run.arguments import seconds, whole
from robot.run.errands import UsageError
from robot.sim.physics import BackendMissing

__all__ = ["ENOUGH", "main", "metrics", "side_by_side"]

SPLIT = ", split"
"""How the names of lines end that are of the robot in processes."""
ENOUGH = 98.0
"""Per cent of its rate that every stream must keep."""


def metrics(backend: str, duration: float, loops: Sequence[int] = (0,)) -> tuple[Metric, ...]:
    """All lines; each seed is one run of the robot and one of the control loop alone at 500 Hz, `duration` seconds each.

    In physics the robot runs in processes, too; and both again for each number of endless `loops` that share its processor.
    """

    @lru_cache
    def robot(seed: int) -> Run:
        return run_robot(backend, seed, duration)

    @lru_cache
    def loop(seed: int) -> Punctuality:
        return run_loop(backend, seed, duration, 500.0)

    def stream(name: str, rate: float) -> Callable[[int], float]:
        return lambda seed: 100.0 * robot(seed).rates[name] / rate

    enough, nothing = (ENOUGH, ENOUGH, ENOUGH), (None, None, None)
    return (
        *(
            Metric(f"{row} {name}, {rate:g} Hz", "%", enough, stream(name, rate), larger_is_better=True)
            for row, name, rate in (*STREAMS, *TIMERS)
        ),
        Metric("control at 200 Hz, period error p50", "ms", nothing, lambda seed: robot(seed).control.p50),
        Metric("control at 200 Hz, period error p99", "ms", (2.0, 1.0, 0.5), lambda seed: robot(seed).control.p99),
        Metric("control at 200 Hz, deadlines missed", "%", (1.0, 0.1, 0.0), lambda seed: robot(seed).control.missed),
        Metric("share of one core, camera unused", "%", nothing, lambda seed: robot(seed).quiet_share),
        Metric("share of one core, all sensors in use", "%", (100.0, 60.0, 35.0), lambda seed: robot(seed).share),
        Metric("falls", "", (0.0, None, None), lambda seed: float(robot(seed).falls)),
        Metric("nodes restarted", "", nothing, lambda seed: float(robot(seed).restarts)),
        *(compared(duration, loops) if backend == "physics" else ()),
        Metric("RT-05 control alone, 500 Hz", "%", enough, lambda seed: loop(seed).rate / 5.0, larger_is_better=True),
        Metric("RT-05 at 500 Hz, period error p50", "ms", nothing, lambda seed: loop(seed).p50),
        Metric("RT-05 at 500 Hz, period error p99", "ms", nothing, lambda seed: loop(seed).p99),
        Metric("RT-05 at 500 Hz, deadlines missed", "%", nothing, lambda seed: loop(seed).missed),
    )


def compared(duration: float, loops: Sequence[int]) -> tuple[Metric, ...]:
    """The lines that are told of the robot in processes, and, with endless loops beside it, of the robot in one process."""

    @lru_cache
    def one(busy: int, seed: int) -> Run:
        return run_robot("physics", seed, duration, busy)

    @lru_cache
    def split(busy: int, seed: int) -> Run:
        return run_split(seed, duration, busy)

    lines: list[Metric] = []
    for busy in loops:
        beside = f"{busy} endless loop{'' if busy == 1 else 's'} beside: " if busy else ""
        for take, where in ((one, ""), (split, SPLIT)):
            if busy or where:
                lines += _lines(beside, where, partial(take, busy))
    return tuple(lines)


def _lines(beside: str, where: str, take: Callable[[int], Run]) -> tuple[Metric, ...]:
    nothing = (None, None, None)
    p99, missed = ((2.0, 1.0, 0.5), (1.0, 0.1, 0.0)) if not beside else (nothing, nothing)
    head = f"{beside}control at 200 Hz"
    return (
        Metric(f"{head}, period error p50{where}", "ms", nothing, lambda seed: take(seed).control.p50),
        Metric(f"{head}, period error p99{where}", "ms", p99, lambda seed: take(seed).control.p99),
        Metric(f"{head}, deadlines missed{where}", "%", missed, lambda seed: take(seed).control.missed),
        Metric(f"{beside}share of one core, camera unused{where}", "%", nothing, lambda seed: take(seed).quiet_share),
        Metric(f"{beside}share of one core, all sensors in use{where}", "%", nothing, lambda seed: take(seed).share),
        Metric(f"{beside}falls{where}", "", (0.0, None, None), lambda seed: float(take(seed).falls)),
        Metric(f"{beside}nodes restarted{where}", "", nothing, lambda seed: float(take(seed).restarts)),
    )


def side_by_side(result: Mapping[str, Any]) -> str:
    """The lines that were measured in one process and in several, as a table of two columns; empty if there are none."""
    rows = {row["name"]: row for row in result["metrics"]}
    pairs = [(name, row, rows[name + SPLIT]) for name, row in rows.items() if name + SPLIT in rows]
    if not pairs:
        return ""
    lines = [f"{'':<62}{'one process':>14}{'split':>14}"]
    for name, one, split in pairs:
        lines.append(f"{name:<62}{one['median']:>14.4g}{split['median']:>14.4g} {one['unit']}")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric is at least acceptable, 1 if one is not, 3 without the physics back end. Raises `UsageError`."""
    line = parser("rates", (__doc__ or "").split("\n")[0], seeds=(1,))
    line.add_argument(
        "--duration", type=seconds, default=10.0, metavar="S", help="seconds that are measured (default 10)"
    )
    line.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body that is simulated meanwhile"
    )
    line.add_argument(
        "--loops", type=whole(0, 8), nargs="+", default=[0], metavar="N",
        help="measure with so many endless loops on the same processor, too: 0 1 2 (default 0)",
    )  # fmt: skip
    asked = line.parse_args(argv)
    if asked.quick:
        raise UsageError("--quick: there is nothing quicker here than a short --duration")
    try:
        result = measure(
            metrics(asked.backend, asked.duration, asked.loops), asked.seeds, backend=asked.backend, only=asked.only, clock="real", duration=asked.duration,
            load_before=round(os.getloadavg()[0], 2),
        )  # fmt: skip
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    title = f"the whole robot on the real clock for {asked.duration:g} s, listened to"
    code = conclude(title, result, as_json=asked.json)
    if not asked.json and (beside := side_by_side(result)):
        print(f"\n{beside}\nload average before: {result['load_before']:g}")
    slow = [
        row["name"]
        for row in result["metrics"]
        if row["unit"] == "%" and row["better"] == "larger" and row["median"] < ENOUGH
    ]
    if slow:
        print(f"below {ENOUGH:g} % of its rate: {'; '.join(slow)}", file=sys.stderr)
    return code
