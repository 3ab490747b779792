"""The command line: `python -m tests.chaos processes --kills 50 --seed 1`, `python -m tests.chaos hosts --seeds 500`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from tests.chaos.hosts import PLANTED, run_hosts
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
    hosts = kinds.add_parser(
        "hosts",
        help="a tree over three simulated hosts, whose links are cut and slowed down and whose machines lose power",
    )
    hosts.add_argument("--seeds", type=int, default=20, metavar="N")
    hosts.add_argument("--first", type=int, default=0, metavar="S", help="the first seed (0)")
    hosts.add_argument("--plant", choices=tuple(PLANTED), help="take something away that is needed: it must be found")
    given = parser.parse_args(argv)
    if given.kind == "hosts":
        return run_hosts(given.seeds, given.first, given.plant)
    return run_kills(given.kills, given.seed)


if __name__ == "__main__":
    sys.exit(main())
