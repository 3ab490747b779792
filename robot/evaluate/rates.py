"""The whole robot on the real clock: the rate of every stream, how punctual its control loop is, and its share of a processor core.

`python -m robot evaluate rates`. Somebody listens to every sensor, the camera included. What is measured is this machine as it is now: run
it on an idle one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import lru_cache

from robot.evaluate.levels import Metric, conclude, measure, parser
from robot.evaluate.rates_run import STREAMS, TIMERS, Punctuality, Run, run_loop, run_robot
from robot.run.options import UsageError, seconds
from robot.sim.physics import BackendMissing

__all__ = ["ENOUGH", "main", "metrics"]

ENOUGH = 98.0
"""Per cent of its rate that every stream must keep."""


def metrics(backend: str, duration: float) -> tuple[Metric, ...]:
    """All lines; each seed is one run of the robot and one of the control loop alone at 500 Hz, `duration` seconds each."""

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
        Metric("RT-05 control alone, 500 Hz", "%", enough, lambda seed: loop(seed).rate / 5.0, larger_is_better=True),
        Metric("RT-05 at 500 Hz, period error p50", "ms", nothing, lambda seed: loop(seed).p50),
        Metric("RT-05 at 500 Hz, period error p99", "ms", nothing, lambda seed: loop(seed).p99),
        Metric("RT-05 at 500 Hz, deadlines missed", "%", nothing, lambda seed: loop(seed).missed),
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric is at least acceptable, 1 if one is not, 3 without the physics back end. Raises `UsageError`."""
    line = parser("rates", (__doc__ or "").split("\n")[0], seeds=(1,))
    line.add_argument(
        "--duration", type=seconds, default=10.0, metavar="S", help="seconds that are measured (default 10)"
    )
    line.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body that is simulated meanwhile"
    )
    asked = line.parse_args(argv)
    if asked.quick:
        raise UsageError("--quick: there is nothing quicker here than a short --duration")
    try:
        result = measure(
            metrics(asked.backend, asked.duration), asked.seeds, backend=asked.backend, only=asked.only, clock="real", duration=asked.duration
        )  # fmt: skip
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    title = f"the whole robot on the real clock for {asked.duration:g} s, listened to"
    code = conclude(title, result, as_json=asked.json)
    slow = [
        row["name"]
        for row in result["metrics"]
        if row["unit"] == "%" and row["better"] == "larger" and row["median"] < ENOUGH
    ]
    if slow:
        print(f"below {ENOUGH:g} % of its rate: {'; '.join(slow)}", file=sys.stderr)
    return code
