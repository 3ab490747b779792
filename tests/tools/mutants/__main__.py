"""`python -m tests.tools.mutants [--count 300] [--seed N] [--only channel|services|actions|supervisor] [--at-least PERCENT]`"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random

from tests.tools.mutants.mutate import Mutant, mutants_of
from tests.tools.mutants.trial import SUBJECTS, Workshop

ROOT = Path(__file__).parents[3]
PATIENCE = 5.0
"""A mutant may take this many times as long as the tests do without it, and `LEAST` seconds in any case."""
LEAST = 30.0


def drawn(root: Path, names: list[str], count: int, seed: int) -> list[tuple[str, Mutant]]:
    """`count` mutants of these subjects, or all where there are fewer; the same for the same seed and sources.

    `root` is the copy, not the project: somebody may be at work in the project while this runs.
    """
    every = [
        (name, mutant)
        for name in names
        for pattern in SUBJECTS[name].files
        for path in sorted(root.glob(pattern))
        for mutant in mutants_of(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))
    ]
    chosen = every if count >= len(every) else Random(seed).sample(every, count)
    print(f"{len(every)} mutants of {', '.join(names)}; trying {len(chosen)}, seed {seed}", flush=True)
    return chosen


def main() -> int:
    """Exit status: 0 when enough mutants were killed (`--at-least`, by default all), 1 when too many survived, 2 for wrong usage."""
    parser = argparse.ArgumentParser(prog="python -m tests.tools.mutants", description="Mutation testing of the core.")
    parser.add_argument("--count", type=int, default=300, help="how many mutants to try (default: 300)")
    parser.add_argument("--seed", type=int, default=0, help="which ones (default: 0)")
    parser.add_argument("--only", choices=SUBJECTS, action="append", help="one subject; may be given several times")
    parser.add_argument("--at-least", type=float, default=100.0, help="how many percent must be killed (default: 100)")
    options = parser.parse_args()
    names: list[str] = options.only or list(SUBJECTS)
    fates: dict[str, Counter[str]] = {name: Counter() for name in names}
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        workshop = Workshop(ROOT, Path(folder))
        limits = {name: max(LEAST, PATIENCE * workshop.baseline(SUBJECTS[name].tests)) for name in names}
        for name, mutant in drawn(workshop.folder, names, options.count, options.seed):
            fate = workshop.try_out(mutant, SUBJECTS[name].tests, limits[name])
            fates[name][fate] += 1
            print(f"{fate:<9}  {mutant}", flush=True)
    total: Counter[str] = Counter()
    for name, counts in fates.items():
        total += counts
        print(f"{name:<12}{score(counts)}")
    print(f"{'all':<12}{score(total)}; {time.monotonic() - began:.0f} s")
    return 0 if killed_share(total) >= options.at_least else 1


def killed_share(counts: Counter[str]) -> float:
    """How many of 100 mutants were killed; all, where none was tried."""
    tried = counts.total()
    return 100.0 * (tried - counts["survived"]) / tried if tried else 100.0


def score(counts: Counter[str]) -> str:
    tried = counts.total()
    killed = tried - counts["survived"]
    share = f"{killed_share(counts):.1f} %" if tried else "-"
    return f"{killed:4} of {tried:4} killed ({counts['timed out']} by time), {counts['survived']:3} survived: {share}"


if __name__ == "__main__":
    sys.exit(main())
