"""Metrics with levels: lines that are measured for several seeds, held against three bounds, and printed as a table or JSON.

Acceptable is what a first version must reach, excellent is better than what is published of robots of this kind.

Every figure is the median over the seeds, with the least and the largest, and is shown with its back end, seeds, machine and date.
"""

from __future__ import annotations

import json
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

from cli.command import UsageError
from robot.run.arguments import parse_seed
from robot.run.status import Part, StatusLine
from tests.figures.measurement import Measurement, Result, add_running, heading
from tests.figures.trials import each

LEVELS = ("acceptable", "good", "excellent")
NO_LEVEL = "no bounds"
Bounds: TypeAlias = tuple[float | None, float | None, float | None]


@dataclass(frozen=True, slots=True)
class Metric:
    """One line of the table. `quick` lines are measured by `--quick` too."""

    name: str
    unit: str
    bounds: Bounds
    """Of the three levels; None where a level has none, or asks for more than is measured here."""
    take: Callable[[int], float]
    """The value for one seed."""
    larger_is_better: bool = False
    quick: bool = False

    def level(self, value: float) -> str:
        """The highest level that `value` reaches; empty if it reaches none of those that have a bound."""
        bounds = [(name, bound) for name, bound in zip(LEVELS, self.bounds, strict=True) if bound is not None]
        reached = [name for name, bound in bounds if (value >= bound if self.larger_is_better else value <= bound)]
        return reached[-1] if reached else "" if bounds else NO_LEVEL


def add_levels(parser: ArgumentParser, seeds: Sequence[int] = (1, 2, 3, 4, 5)) -> None:
    """Add --seeds, --quick and --only."""
    parser.add_argument(
        "--seeds", type=parse_seed, nargs="+", default=list(seeds), help="one run of everything per seed"
    )
    parser.add_argument("--quick", action="store_true", help="the short measurements only")
    parser.add_argument("--only", default="", help="only metrics whose name contains this")


def of_metrics(
    name: str,
    help: str,
    takes: str,
    metrics: Callable[[Namespace], Sequence[Metric]],
    title: Callable[[Namespace], str],
    *,
    backend: str = "physics",
    settings: Callable[[Namespace], dict[str, Any]] = lambda asked: {},
    arguments: Callable[[ArgumentParser], object] = lambda parser: None,
) -> Measurement:
    """A measurement of metrics, which a function of a module makes for what was asked; `settings` of it are told in the result."""

    def all_arguments(parser: ArgumentParser) -> None:
        add_levels(parser)
        add_running(parser)
        arguments(parser)

    def take(asked: Namespace) -> Result:
        make = partial(metrics, asked)
        result = measure(
            make(), asked.seeds, backend=backend, quick=asked.quick, only=asked.only, takes=takes, jobs=asked.jobs, file=asked.resume,
            make=make, **settings(asked),
        )  # fmt: skip
        return levelled(title(asked), result)

    return Measurement(name, help, takes, all_arguments, take)


def levelled(title: str, result: Mapping[str, Any]) -> Result:
    """What `measure` gave, as a table with a title; good if every metric is at least acceptable."""
    return Result(result, partial(table, title), all(row["level"] for row in result["metrics"]))


def measure(
    metrics: Sequence[Metric],
    seeds: Sequence[int],
    *,
    backend: str,
    quick: bool = False,
    only: str = "",
    takes: str = "",
    jobs: int = 1,
    file: Path | None = None,
    make: Callable[[], Sequence[Metric]] | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Measure each line for each seed, saying on stderr how far it is. `takes` is how long all of it takes, in words.

    With `jobs` above 1 in so many processes, for which `make` has to make the metrics again: a function that can be pickled. `file` keeps the
    values, and those that it has are not measured again.

    Returns a dict that JSON can hold: back end, seeds, `settings`, and one entry per metric with its value per seed, median, least,
    largest, bounds and the level that its median reaches. Raises `UsageError` when no metric is called like `only`.
    """
    chosen = [metric for metric in metrics if only in metric.name and (metric.quick or not quick)]
    if not chosen:
        known = ", ".join(repr(metric.name) for metric in metrics if metric.quick or not quick)
        raise UsageError(f"--only {only}: no metric's name contains that; there are: {known}")
    about = f"; all of it takes {takes}" if takes and len(chosen) == len(metrics) else ""
    print(f"metrics to measure: {len(chosen)}, each with {len(seeds)} seeds{about}", file=sys.stderr, flush=True)
    rows: list[dict[str, Any]] = []
    line = StatusLine()
    by_name = {metric.name: metric for metric in chosen}
    cases = [(metric.name, seed) for metric in chosen for seed in seeds]
    take = partial(_take, by_name) if jobs == 1 or make is None else partial(_make_and_take, make)
    what = json.dumps({"backend": backend, **settings}, sort_keys=True)
    with closing(each(take, cases, jobs=jobs if make is not None else 1, file=file, what=what)) as outcomes:
        for number, metric in enumerate(chosen, start=1):
            began, values = time.perf_counter(), list[float]()
            for seed in seeds:
                if line.live:
                    done = f"seed {seed}, {len(values)} of {len(seeds)} done"
                    line.show([Part(1, f"[{number}/{len(chosen)}] {metric.name}: {done}")])
                values.append(float(next(outcomes)["value"]))
            rows.append(_row(metric, values))
            seconds = time.perf_counter() - began
            line.clear()
            print(
                f"[{number}/{len(chosen)}] {metric.name}: {median(values):.4g} {metric.unit} ({seconds:.0f} s)",
                file=sys.stderr, flush=True,
            )  # fmt: skip
    return {"backend": backend, "seeds": list(seeds), **settings, "metrics": rows}


def _take(metrics: Mapping[str, Metric], case: tuple[str, int]) -> dict[str, Any]:
    name, seed = case
    return {"value": metrics[name].take(seed)}


def _make_and_take(make: Callable[[], Sequence[Metric]], case: tuple[str, int]) -> dict[str, Any]:
    """In a process of its own."""
    return _take({metric.name: metric for metric in make()}, case)


def table(title: str, result: Mapping[str, Any]) -> str:
    """What `measure` gave, as text under a title line."""
    lines = [
        f"{title}, back end {result['backend']}",
        f"seeds {', '.join(map(str, result['seeds']))}; {heading(result)}",
        "",
        f"{'metric':<42}{'median':>10}{'min':>10}{'max':>10} {'unit':<6}{'accept.':>8}{'good':>8}{'excell.':>8}  level",
    ]
    for row in result["metrics"]:
        bounds = "".join(f"{'-' if bound is None else format(bound, '.4g'):>8}" for bound in row["bounds"].values())
        values = "".join(f"{row[key]:>10.4g}" for key in ("median", "min", "max"))
        lines.append(f"{row['name']:<42}{values} {row['unit']:<6}{bounds}  {row['level'] or 'below acceptable'}")
    return "\n".join(lines)


def _row(metric: Metric, values: Sequence[float]) -> dict[str, Any]:
    middle = median(values)
    return {
        "name": metric.name,
        "unit": metric.unit,
        "median": middle,
        "min": min(values),
        "max": max(values),
        "values": list(values),
        "bounds": dict(zip(LEVELS, metric.bounds, strict=True)),
        "better": "larger" if metric.larger_is_better else "smaller",
        "level": metric.level(middle),
    }
