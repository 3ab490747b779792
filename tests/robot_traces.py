"""The traces of whole robot runs: `python -m tests.robot_traces [--seconds S] [--against FILE]`.

One line per run, its name and the hash over everything that happened in it. A change that is not meant to change what the robot does
leaves every line as it was: write them to a file before it, and compare `--against` that file after it. The hashes belong to one machine
and one set of libraries, so none are kept in the repository.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

ROOT = Path(__file__).parents[1]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""One thread for linear algebra: the last bits of a sum depend on their number."""

RUNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "physics": ("--backend", "physics"),
        "kinematic": ("--backend", "kinematic"),
        "docking": ("--backend", "kinematic", "--battery", "12"),
        "fetching": ("--backend", "kinematic", "--world", "kitchen", "--fetch", "cup", "1.9", "-1", "0.4"),
        "fetching in physics": ("--backend", "physics", "--world", "kitchen", "--fetch", "cup", "1.9", "-1", "0.4"),
    }
)
"""Their options; together they visit every node of the robot."""


def trace(options: Sequence[str], seconds: float) -> str:
    """The hash of one run of so many simulated seconds, seed 1. Raises `RuntimeError` with its last words when it printed none."""
    words = ("run", "--clock", "virtual", "--seed", "1", "--trace", "--log-level", "info", "--duration", f"{seconds:g}")
    done = subprocess.run(
        [sys.executable, "-m", "robot", *words, *options],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **dict.fromkeys(THREADS, "1")},
        capture_output=True,
        text=True,
        check=False,
    )
    found = [line.split()[1] for line in done.stdout.splitlines() if line.startswith("trace ")]
    if len(found) != 1:
        raise RuntimeError(f"no trace; exit code {done.returncode}: {done.stderr[-2000:]}")
    return found[0]


def main(argv: Sequence[str] | None = None) -> int:
    """0: printed, and equal to what was expected; 1: something differs."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.robot_traces", description=__doc__.splitlines()[0] if __doc__ else None
    )
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated, of each run (default 60)")
    parser.add_argument(
        "--against", type=Path, metavar="FILE", help="an earlier output of this command to compare with"
    )
    parser.add_argument(
        "--only", choices=tuple(RUNS), action="append", help="this run alone; may be given several times"
    )
    given = parser.parse_args(argv)
    expected = given.against.read_text(encoding="utf-8").splitlines() if given.against else None
    differs = False
    for name in given.only or RUNS:
        line = f"{trace(RUNS[name], given.seconds)}  {name}"
        changed = expected is not None and line not in expected
        differs = differs or changed
        print(line + ("  CHANGED" if changed else ""), flush=True)
    return 1 if differs else 0


if __name__ == "__main__":
    sys.exit(main())
