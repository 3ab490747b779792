"""How well the robot walks, measured on the physics back end and held against the ladder of acceptance metrics.

`python -m robot evaluate walk` or `python -m robot.evaluate.walk`. Every figure is the median over the seeds, with the least and
the largest. The closed loop is the robot's own: knee torque curve, motor delay, noisy sensors, estimator, 200 Hz control.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from importlib import metadata
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

from robot.evaluate import walk_measures as measure
from robot.run.options import Parser, UsageError
from robot.world.physics import BackendMissing

__all__ = ["Metric", "main", "metrics", "run", "show"]

LEVELS = ("first version", "good", "beats the anchors")
NO_LEVEL = "not in the ladder"
Ladder: TypeAlias = tuple[float | None, float | None, float | None]


@dataclass(frozen=True, slots=True)
class Metric:
    """One line of the table. `quick` lines are measured by `--quick` too."""

    name: str
    unit: str
    ladder: Ladder
    """The bounds of the three columns; None where a column has none, or asks for more than is measured here."""
    take: Callable[[int], float]
    larger_is_better: bool = False
    quick: bool = False

    def level(self, value: float) -> str:
        """The highest column of the ladder that `value` reaches; empty if it reaches none of those that have a bound."""
        bounds = [(name, bound) for name, bound in zip(LEVELS, self.ladder, strict=True) if bound is not None]
        reached = [name for name, bound in bounds if (value >= bound if self.larger_is_better else value <= bound)]
        return reached[-1] if reached else "" if bounds else NO_LEVEL


def metrics(delay: float, minutes: float) -> tuple[Metric, ...]:
    """All lines, for a motor delay (s) and a length of the endurance runs."""

    def speed(vx: float, wz: float = 0.0) -> Callable[[int], float]:
        return lambda seed: measure.speed_error(seed, delay, (vx, 0.0, wz))

    def push(x: float, y: float) -> Callable[[int], float]:
        return lambda seed: measure.largest_push(seed, delay, (x, y))

    def slope(direction: str) -> Callable[[int], float]:
        return lambda seed: measure.steepest(seed, delay, direction)

    def endured(asked: float) -> float | None:
        """No falls, if the runs are as long as the column asks."""
        return 0.0 if minutes >= asked else None

    seconds = 60.0 * minutes
    return (
        Metric("leg: |FK(IK(p)) - p|", "m", (1e-9, 1e-9, 1e-9), measure.point_error, quick=True),
        Metric("leg: |IK(FK(q)) - q|", "rad", (1e-9, 1e-9, 1e-9), measure.inverse_error, quick=True),
        Metric("leg: Jacobian", "m/rad", (1e-6, 1e-6, 1e-6), measure.jacobian_error, quick=True),
        Metric("speed rmse at 0.3 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.3), quick=True),
        Metric("speed rmse at 0.6 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.6), quick=True),
        Metric("speed rmse at 1.0 m/s", "m/s", (0.10, 0.05, 0.02), speed(1.0), quick=True),
        Metric("speed rmse at 1.6 m/s", "m/s", (None, None, 0.05), speed(1.6), quick=True),
        Metric("yaw rate rmse at 1.0 rad/s", "rad/s", (0.10, 0.03, 0.01), speed(0.0, 1.0), quick=True),
        Metric(
            f"falls in {minutes:g} min of random commands",
            "",
            (endured(2.0), endured(10.0), None),
            lambda seed: measure.falls(seed, delay, seconds),
            quick=True,
        ),
        Metric(
            f"falls in {minutes:g} min with 40 N s pushes",
            "",
            (None, None, endured(10.0)),
            lambda seed: measure.falls(seed, delay, seconds, 40.0),
        ),
        Metric("push to the left, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, 1.0), True),
        Metric("push to the right, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, -1.0), True),
        Metric("push forward, worst phase", "N s", (30.0, 70.0, 90.0), push(1.0, 0.0), True),
        Metric("push back, worst phase", "N s", (30.0, 70.0, 90.0), push(-1.0, 0.0), True),
        Metric("slope up", "deg", (10.0, 20.0, 30.0), slope("up"), True),
        Metric("slope down", "deg", (10.0, 20.0, 30.0), slope("down"), True),
        Metric("slope across", "deg", (10.0, 20.0, 30.0), slope("across"), True),
        Metric("step up, blind", "m", (0.05, 0.10, 0.15), lambda seed: measure.step_up(seed, delay), True),
        Metric("box field", "m", (0.04, 0.08, 0.12), lambda seed: measure.box_field(seed, delay), True),
        Metric("top speed held 20 s", "m/s", (0.8, 1.3, 1.6), lambda seed: measure.top_speed(seed, delay), True),
        Metric(
            "total cost of transport at 1.0 m/s",
            "",
            (1.8, 1.4, 1.1),
            lambda seed: measure.cost_of_transport(seed, delay, 1.0),
            quick=True,
        ),
        Metric(
            "odometry error over 100 m",
            "%",
            (5.0, 1.5, 0.5),
            lambda seed: measure.odometry_error(seed, delay),
            quick=True,
        ),
        Metric(
            "controller and estimator, one step",
            "ms",
            (None, None, None),
            lambda seed: measure.control_cost(seed, delay),
            quick=True,
        ),
    )


def run(
    seeds: Sequence[int] = (1, 2, 3, 4, 5),
    *,
    delay: float = 0.008,
    minutes: float = 2.0,
    quick: bool = False,
    only: str = "",
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Measure for each seed; `delay` is the motor delay (s), `minutes` the length of each endurance run.

    `only` keeps the metrics whose name contains it. Returns a dict that JSON can hold: back end, machine, date, settings and
    one entry per metric with its value per seed, median, least, largest, ladder and the level that its median reaches.
    """
    chosen = [metric for metric in metrics(delay, minutes) if only in metric.name and (metric.quick or not quick)]
    table: list[dict[str, Any]] = []
    for metric in chosen:
        began = time.perf_counter()
        values = [metric.take(seed) for seed in seeds]
        middle = median(values)
        table.append(
            {
                "name": metric.name,
                "unit": metric.unit,
                "median": middle,
                "min": min(values),
                "max": max(values),
                "values": values,
                "ladder": dict(zip(LEVELS, metric.ladder, strict=True)),
                "better": "larger" if metric.larger_is_better else "smaller",
                "level": metric.level(middle),
            }
        )
        if progress is not None:
            progress(f"{metric.name}: {middle:.4g} {metric.unit} ({time.perf_counter() - began:.0f} s)")
    return {
        "backend": "physics",
        "seeds": list(seeds),
        "delay_ms": 1000.0 * delay,
        "date": date.today().isoformat(),
        "machine": _machine(),
        "metrics": table,
    }


def show(result: dict[str, Any]) -> str:
    """The table as text."""
    machine = result["machine"]
    lines = [
        f"walking, back end {result['backend']}, motor delay {result['delay_ms']:g} ms, knee torque curve, noisy estimator",
        f"seeds {', '.join(map(str, result['seeds']))}; {result['date']}; {machine['processor']}, {machine['cores']} cores, "
        f"Python {machine['python']}, MuJoCo {machine['mujoco']}",
        "",
        f"{'metric':<42}{'median':>10}{'min':>10}{'max':>10} {'unit':<6}{'first':>8}{'good':>8}{'beats':>8}  level",
    ]
    for row in result["metrics"]:
        bounds = "".join(f"{'-' if bound is None else format(bound, '.4g'):>8}" for bound in row["ladder"].values())
        values = "".join(f"{row[key]:>10.4g}" for key in ("median", "min", "max"))
        lines.append(f"{row['name']:<42}{values} {row['unit']:<6}{bounds}  {row['level'] or 'below first version'}")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric reaches the first version, 1 if one does not, 3 without the physics back end. Raises `UsageError`."""
    parser = Parser(prog="python -m robot evaluate walk", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5], help="one run of everything per seed")
    parser.add_argument("--delay", type=float, default=8.0, help="motor delay, ms")
    parser.add_argument("--minutes", type=float, default=2.0, help="length of each endurance run")
    parser.add_argument("--quick", action="store_true", help="the short measurements only")
    parser.add_argument("--only", default="", help="only metrics whose name contains this")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    asked = parser.parse_args(argv)

    known = [metric.name for metric in metrics(asked.delay / 1000.0, asked.minutes) if metric.quick or not asked.quick]
    if not any(asked.only in name for name in known):
        raise UsageError(
            f"--only {asked.only}: no metric's name contains that; there are: {', '.join(map(repr, known))}"
        )

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    try:
        result = run(
            asked.seeds,
            delay=asked.delay / 1000.0,
            minutes=asked.minutes,
            quick=asked.quick,
            only=asked.only,
            progress=report,
        )
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 0 if all(row["level"] for row in result["metrics"]) else 1


def _machine() -> dict[str, Any]:

    processor = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.exists():
        names = [line.split(":", 1)[1].strip() for line in described.read_text().splitlines() if "model name" in line]
        processor = names[0] if names else processor
    return {
        "processor": processor,
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "mujoco": metadata.version("mujoco-core"),
    }


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["walk", *sys.argv[1:]]))
