"""`python -m tests.benchmarks [NAME...] [--json]`: run benchmarks and print each figure beside the floor and ours."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pkgutil
import platform
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict

import tests.benchmarks as package
from tests.benchmarks import Row


def names() -> list[str]:
    """The benchmarks there are: modules of this package."""
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__) if not module.name.startswith("_"))


def table(rows: Iterable[Row]) -> str:
    """Rows as text: for each workload and unit the figures, and their ratios to the floor and to the first of ours."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.workload, row.unit), []).append(row)
    lines: list[str] = []
    for (workload, unit), group in groups.items():
        floor, ours = _first(group, "floor"), _first(group, "ours")
        lines += ["", f"{workload}, {unit}", f"  {'':40} {'':6} {unit.split()[0]:>14} {'x floor':>9} {'x ours':>9}"]
        for row in group:
            if row.value is None:
                lines.append(f"  {row.name:40} {row.kind:6} {row.note}")
            else:
                ratios = f"{_ratio(row.value, floor):>9} {_ratio(row.value, ours):>9}"
                lines.append(f"  {row.name:40} {row.kind:6} {_number(row.value):>14} {ratios}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks named, all of them by default."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("name", nargs="*", help=f"{', '.join(names())}; all of them by default")
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    options = parser.parse_args(arguments)
    if unknown := sorted(set(options.name) - set(names())):
        parser.error(f"no such benchmark: {', '.join(unknown)}; there are {', '.join(names())}")
    rows: list[Row] = []
    for name in options.name or names():
        rows += importlib.import_module(f"{package.__name__}.{name}").run()
    if options.json:
        print(json.dumps([asdict(row) for row in rows], indent=1))
    else:
        print(
            f"{platform.python_implementation()} {platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores"
        )
        print(table(rows))
    return 0


def _first(group: Iterable[Row], kind: str) -> float | None:
    return next((row.value for row in group if row.kind == kind and row.value is not None), None)


def _ratio(value: float, reference: float | None) -> str:
    return f"{value / reference:.2f}" if reference else "-"


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.2f}"


if __name__ == "__main__":
    sys.exit(main())
