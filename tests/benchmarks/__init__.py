"""Benchmarks: what ours costs beside the floor (the least the work can cost) and beside its peers.

`python -m tests.benchmarks [NAME...] [--json]` runs the modules of this package, each of which has a function
`run() -> list[Row]`. Ratios within one run are what counts: absolute figures change with the machine and its load. So
contestants take turns, round after round, and the median of their rounds is reported.
"""

from __future__ import annotations

import importlib.util
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

__all__ = ["Contestant", "Kind", "Row", "contest"]

Kind = Literal["ours", "floor", "peer"]


@dataclass(frozen=True, slots=True)
class Row:
    """One figure. Rows of one workload and unit are compared; `value` is None for a peer that is not installed."""

    workload: str
    name: str
    unit: str
    value: float | None
    kind: Kind
    note: str = ""


@dataclass(frozen=True, slots=True)
class Contestant:
    """Somebody who does the work of a workload: `measure()` does it once and returns its figures, one for each unit."""

    name: str
    kind: Kind
    measure: Callable[[], Sequence[float]]
    needs: str = ""
    """Module without which the contestant is skipped."""


def contest(workload: str, units: Sequence[str], contestants: Sequence[Contestant], rounds: int = 5) -> list[Row]:
    """Let the contestants take turns for so many rounds (after one to warm up) and report medians."""
    present = [one for one in contestants if not one.needs or importlib.util.find_spec(one.needs) is not None]
    figures: dict[str, list[Sequence[float]]] = {one.name: [] for one in present}
    for number in range(rounds + 1):
        for one in present:
            measured = one.measure()
            if number > 0:
                figures[one.name].append(measured)
    rows: list[Row] = []
    for one in contestants:
        for index, unit in enumerate(units):
            if one in present:
                value = statistics.median(figure[index] for figure in figures[one.name])
                rows.append(Row(workload, one.name, unit, value, one.kind))
            else:
                rows.append(Row(workload, one.name, unit, None, one.kind, f"skipped: {one.needs} is not installed"))
    return rows
