"""`python -m tests.tools.cli_speed`: how long commands take, each in a fresh process: the median of ten, and that of the CPU time.

The CPU time is what the command itself costs, also on a busy machine. `topic list` looks at a robot in another process; `--help` and the help of a verb
look at nothing.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping

from tests.tools import no_arguments
from tests.tools.cli_docs import ROBACTOR, SCENES, running

RUNS = 10
COMMANDS = (
    ("--help", 60),
    ("topic --help", 60),
    ("topic list", 300),
    ("node list", 300),
    ("param get /imu_publisher use_sim_time", 0),
)
"""Each command, and the milliseconds that it may take (0: no aim)."""


def main() -> None:
    """Print a table."""
    print(
        f"{'command':<45} {'median ms':>9} {'least':>6} {'most':>6} {'aim':>5} {'CPU ms':>7}   CPython {sys.version.split()[0]}"
    )
    with running(SCENES[-1]) as environment:
        for line, aim in COMMANDS:
            runs = [_milliseconds(line, environment) for _ in range(RUNS)]
            took, spent = sorted(run[0] for run in runs), statistics.median(run[1] for run in runs)
            middle = statistics.median(took)
            print(f"{line:<45} {middle:9.0f} {took[0]:6.0f} {took[-1]:6.0f} {aim or '':>5} {spent:7.0f}")


def _milliseconds(line: str, environment: Mapping[str, str]) -> tuple[float, float]:
    """How long a command takes, and its CPU time."""
    start, before = time.perf_counter(), _spent()
    subprocess.run([*ROBACTOR, *line.split()], env=environment, stdout=subprocess.DEVNULL, check=True)
    return (time.perf_counter() - start) * 1e3, (_spent() - before) * 1e3


def _spent() -> float:
    """The CPU time of all processes that were started from here and have ended, seconds."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
