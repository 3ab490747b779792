"""``python -m tests.planted``: explores all planted systems and their healthy twins, and prints a table.

    python -m tests.planted [--seeds 200] [--healthy 400] [NAME ...]

Exits with 1 if a bug was not found, or a healthy system was blamed.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Sequence

from actors.testing.explore import scenario_of
from actors.testing.faults import ALL, Possible
from actors.testing.simulation.isolated import Isolated
from actors.testing.simulation.search import Finding, search
from tests.planted.cases import CASES

SECONDS = 30.0


def explored(name: str, which: str, seeds: range, faults: Sequence[Possible]) -> Finding | None:
    """Explore `tree` or `healthy` of one module, as the command does."""
    make = getattr(importlib.import_module(f"tests.planted.{name}"), which)
    return search(Isolated(scenario_of(make, SECONDS)), seeds, faults)


def main(argv: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.planted", description="Explore the planted systems.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="some of them (all)")
    parser.add_argument("--seeds", type=int, default=200, help="for each planted bug (200)")
    parser.add_argument("--healthy", type=int, default=400, help="for each healthy twin (400)")
    options = parser.parse_args(argv)
    wrong = 0
    print(f"{'system':<18} {'which':<8} {'faults':<7} {'seed':>5} {'seconds':>8}  what is reported")
    for case in CASES:
        if options.names and case.name not in options.names:
            continue
        for which, count, faults in (
            ("tree", options.seeds, "none" if case.order else ""),
            ("tree", options.seeds, "default"),
            ("healthy", options.healthy, "default"),
        ):
            if not (faults and count):
                continue
            begun = time.perf_counter()
            finding = explored(case.name, which, range(count), ALL if faults == "default" else ())
            took = time.perf_counter() - begun
            seed = "-" if finding is None else str(finding.replay.seed)
            text = "" if finding is None else f"{finding.describe().split(', seed')[0]}: {finding.outcome.error}"
            print(
                f"{case.name:<18} {which:<8} {faults:<7} {seed:>5} {took:>8.1f}  {text.splitlines()[0] if text else ''}"
            )
            sys.stdout.flush()
            wrong += (finding is None) == (which == "tree")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
