"""`python -m tests.tools.twice [--shuffle SEED] [ARGUMENTS OF PYTEST]`: the suite twice, with other hashes of strings, and with --shuffle in another order
the second time. Every test must end in the same way, within 4 GB.

Exit code 0 if it did, 1 if something differs, if a test failed, or if a process of the suite took more memory. The memory is the most that a single
process had in RAM at a time, and a test may start several.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

LIMIT = 4 * 10**9
"""Bytes."""
SHOWN = 20
"""How many differences are printed."""


def main(arguments: Sequence[str]) -> int:
    """Run the suite twice and compare."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--shuffle")
    options, rest = parser.parse_known_args(arguments)
    order = [] if options.shuffle is None else ["-p", "tests.tools.order", "--shuffle", options.shuffle]
    with tempfile.TemporaryDirectory() as folder:
        runs = [
            _outcomes(Path(folder) / f"run {number}", number, [*rest, *words])
            for number, words in ((1, ()), (2, order))
        ]
    differing = differences(*runs)
    print("\n".join(differing[:SHOWN]))
    failed = sum(line.endswith("failed") for line in runs[0])
    most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    print(
        f"{len(runs[0])} tests, {failed} failed, {len(differing)} ended differently; at most {most / 1e9:.2f} GB in a process"
    )
    return int(bool(differing) or bool(failed) or not runs[0] or most > LIMIT)


def differences(first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Where two runs differ; the order of the tests does not matter."""
    ended, then = dict(map(_ended, first)), dict(map(_ended, second))
    return [
        f"first {test} {ended.get(test, 'not run')}; then {then.get(test, 'not run')}"
        for test in (ended | then)
        if ended.get(test) != then.get(test)
    ]


def _ended(line: str) -> tuple[str, str]:
    test, _, outcome = line.rpartition(" ")
    return test, outcome


def _outcomes(path: Path, hashes: int, arguments: Sequence[str]) -> list[str]:
    words = (
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "tests.tools.outcomes",
        "--outcomes",
        str(path),
    )
    subprocess.run([sys.executable, *words, *arguments], env={**os.environ, "PYTHONHASHSEED": str(hashes)}, check=False)
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
