"""The command line: `python -m tests.chaos processes --kills 50 --seed 1`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from tests.chaos.processes import run_kills


def main(argv: Sequence[str] | None = None) -> int:
    """0: everything held; 1: something did not, and is named."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos")
    kinds = parser.add_subparsers(dest="kind", required=True)
    processes = kinds.add_parser(
        "processes", help="kill -9 each process of the robot in turn, while it walks its patrol in physics"
    )
    processes.add_argument("--kills", type=int, default=10, metavar="N")
    processes.add_argument("--seed", type=int, default=1, metavar="S")
    given = parser.parse_args(argv)
    return run_kills(given.kills, given.seed)


if __name__ == "__main__":
    sys.exit(main())
