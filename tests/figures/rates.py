"""The whole robot on the real clock: the rate of every stream, how punctual its control loop is, and its share of a processor core.

`python -m tests.figures rates`. Somebody listens to every sensor, the camera included; the processor time is told without listeners, too. What
is measured is this machine as it is now: run it on an idle one.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

from cli.command import UsageError
from robot.run.arguments import seconds, whole
from robot.run.tasks import checked
from tests.figures.levels import Metric, add_levels, levelled, measure
from tests.figures.measurement import Measurement, Result
from tests.figures.rates_run import STREAMS, TIMERS, Punctuality, Run, run_loop, run_robot
from tests.figures.rates_split import run_split
from tests.figures.rates_start import Start, start_robot

SPLIT = ", split"
"""How the names of lines end that are of the robot in processes."""
RATE = 200.0
"""Of the control loop, Hz."""
PROCESSES = ("body", "control", "safety", "perception", "navigation", "mission", "this one", "others")
"""Those of the robot without an arm."""
ENOUGH = 98.0
"""Per cent of its rate that every stream must keep."""


def metrics(
    backend: str, duration: float, loops: Sequence[int] = (0,), rate: float = RATE, *, fifo: bool = True
) -> tuple[Metric, ...]:
    """All lines; each seed is one run of the robot and one of the control loop alone at 500 Hz, `duration` seconds each.

    In physics the robot runs in processes, too; and both again for each number of endless `loops` that share its processor. Without 0 among
    them, and with another `rate` (Hz) of control, there are only the lines that compare the two. Without `fifo` the processes ask for no
    real-time scheduling.
    """
    whole = 0 in loops and rate == RATE
    compare = compared(duration, loops, rate, fifo=fifo, whole=whole) if backend == "physics" else ()
    if whole and compare:
        compare += tuple(_starts())
    return _all(backend, duration, compare) if whole or backend != "physics" else compare


def _all(backend: str, duration: float, compare: tuple[Metric, ...]) -> tuple[Metric, ...]:

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
        Metric("share of one core, nobody listening", "%", nothing, lambda seed: robot(seed).alone_share),
        Metric("share of one core, camera unused", "%", nothing, lambda seed: robot(seed).quiet_share),
        Metric("share of one core, all sensors in use", "%", (100.0, 60.0, 35.0), lambda seed: robot(seed).share),
        Metric("falls", "", (0.0, None, None), lambda seed: float(robot(seed).falls)),
        Metric("nodes restarted", "", nothing, lambda seed: float(robot(seed).restarts)),
        *compare,
        Metric("RT-05 control alone, 500 Hz", "%", enough, lambda seed: loop(seed).rate / 5.0, larger_is_better=True),
        Metric("RT-05 at 500 Hz, period error p50", "ms", nothing, lambda seed: loop(seed).p50),
        Metric("RT-05 at 500 Hz, period error p99", "ms", nothing, lambda seed: loop(seed).p99),
        Metric("RT-05 at 500 Hz, deadlines missed", "%", nothing, lambda seed: loop(seed).missed),
    )


def compared(
    duration: float, loops: Sequence[int], rate: float = RATE, *, fifo: bool = True, whole: bool = True
) -> tuple[Metric, ...]:
    """The lines that are told of the robot in processes, and of the robot in one, unless `whole`: then those without loops stand elsewhere."""

    @lru_cache
    def one(busy: int, seed: int) -> Run:
        return run_robot("physics", seed, duration, busy, rate)

    @lru_cache
    def split(busy: int, seed: int) -> Run:
        return run_split(seed, duration, busy, rate, fifo=fifo)

    lines: list[Metric] = []
    for busy in loops:
        beside = f"{busy} endless loop{'' if busy == 1 else 's'} beside: " if busy else ""
        for take, where in ((one, ""), (split, SPLIT)):
            if busy or where or not whole:
                lines += _lines(beside, where, rate, partial(take, busy))
        lines += _by_process(beside, partial(split, busy))
    return tuple(lines)


def _starts() -> Iterator[Metric]:
    """The start of the robot, in one process and in several."""

    @lru_cache
    def start(seed: int, *words: str) -> Start:
        return start_robot(seed, *words)

    nothing = (None, None, None)
    yield Metric("start, seconds", "s", nothing, lambda seed: start(seed).wall)
    yield Metric("start, processor time", "s", nothing, lambda seed: start(seed).processor)
    yield Metric(f"start, seconds{SPLIT}", "s", nothing, lambda seed: start(seed, "--processes").wall)
    yield Metric(f"start, processor time{SPLIT}", "s", nothing, lambda seed: start(seed, "--processes").processor)


def _lines(beside: str, where: str, rate: float, take: Callable[[int], Run]) -> tuple[Metric, ...]:
    nothing = (None, None, None)
    bounded = not beside and rate == RATE
    p99, missed = ((2.0, 1.0, 0.5), (1.0, 0.1, 0.0)) if bounded else (nothing, nothing)
    head = f"{beside}control at {rate:g} Hz"
    return (
        Metric(f"{head}, period error p50{where}", "ms", nothing, lambda seed: take(seed).control.p50),
        Metric(f"{head}, period error p99{where}", "ms", p99, lambda seed: take(seed).control.p99),
        Metric(f"{head}, deadlines missed{where}", "%", missed, lambda seed: take(seed).control.missed),
        Metric(
            f"{beside}share of one core, nobody listening{where}", "%", nothing, lambda seed: take(seed).alone_share
        ),
        Metric(f"{beside}share of one core, camera unused{where}", "%", nothing, lambda seed: take(seed).quiet_share),
        Metric(f"{beside}share of one core, all sensors in use{where}", "%", nothing, lambda seed: take(seed).share),
        Metric(f"{beside}falls{where}", "", (0.0, None, None), lambda seed: float(take(seed).falls)),
        Metric(f"{beside}nodes restarted{where}", "", nothing, lambda seed: float(take(seed).restarts)),
    )


def _by_process(beside: str, take: Callable[[int], Run]) -> Iterator[Metric]:
    """The share of each process, nobody listening."""

    def share(name: str) -> Callable[[int], float]:
        return lambda seed: take(seed).shares.get(name, 0.0)

    for name in PROCESSES:
        yield Metric(
            f"{beside}share of one core, nobody listening, process: {name}", "%", (None, None, None), share(name)
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
        runs = one.get("values", ())
        if name.endswith("falls") and len(runs) > 1:  # the median of ten runs does not show that the robot fell in four
            fallen, too = sum(runs), sum(split["values"])
            lines.append(f"{f'{name}, in all of {len(runs)} runs':<62}{fallen:>14.4g}{too:>14.4g}")
    return "\n".join(lines)


def _take(asked: argparse.Namespace) -> Result:
    seeds = _checked(asked)
    told = measure(
        metrics(asked.backend, asked.duration, asked.loops, asked.rate, fifo=asked.fifo), seeds, backend=asked.backend,
        only=asked.only, clock="real", duration=asked.duration, rate=asked.rate, fifo=asked.fifo, load_before=round(os.getloadavg()[0], 2),
    )  # fmt: skip
    result = levelled(f"the whole robot on the real clock for {asked.duration:g} s, listened to", told)
    slow = [
        row["name"]
        for row in told["metrics"]
        if row["unit"] == "%" and row["better"] == "larger" and row["median"] < ENOUGH
    ]
    if slow:
        print(f"below {ENOUGH:g} % of its rate: {'; '.join(slow)}", file=sys.stderr)

    def show(values: Mapping[str, Any]) -> str:
        beside = side_by_side(values)
        return result.show(values) + (f"\n\n{beside}\nload average before: {values['load_before']:g}" if beside else "")

    return result._replace(show=show)


def _checked(asked: argparse.Namespace) -> Sequence[int]:
    """The seeds. Raises `UsageError` for what cannot be measured."""
    checked("--rate", asked.rate, 100.0, 500.0, "Hz")
    if (asked.rate != RATE or 0 not in asked.loops) and asked.backend != "physics":
        raise UsageError(
            "--rate, --loops: one process and several are compared in physics; leave out --backend kinematic"
        )
    if asked.quick:
        raise UsageError("--quick: there is nothing quicker here than a short --duration")
    return range(1, asked.repeat + 1) if asked.repeat > 1 else asked.seeds


def _arguments(line: argparse.ArgumentParser) -> None:
    add_levels(line, seeds=(1,))
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
    line.add_argument(
        "--rate", type=float, default=RATE, metavar="HZ", help="of the control loop, 100 to 500 (default 200)"
    )
    line.add_argument(
        "--fifo", action=argparse.BooleanOptionalAction, default=True,
        help="let the processes of the robot ask for real-time scheduling (default), or not",
    )  # fmt: skip
    line.add_argument(
        "--repeat", type=whole(1, 100), default=1, metavar="N", help="so many runs of each, with the seeds 1 to N"
    )


MEASUREMENT = Measurement(
    "rates",
    "the whole robot on the real clock: the rate of every stream, the control loop's punctuality, and its share of a core",
    "a minute",
    _arguments,
    _take,
)
