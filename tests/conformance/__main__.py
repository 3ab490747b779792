"""`python -m tests.conformance FOLDER`: run every vector file of a folder for which there is a check module."""

import argparse
import sys
from pathlib import Path

from tests.conformance import crossing
from tests.conformance.runner import run_folder

CROSSING = ("parameters", "action_status", "cancel_goals", "lifecycle_transitions", "qos_compatibility", "timers")
"""The families with a client and a server."""


def main() -> int:
    """Exit status: 0 when no core case failed, 1 otherwise or when the folder holds no vectors, 2 for wrong usage."""
    parser = argparse.ArgumentParser(prog="python -m tests.conformance", description="Run conformance vectors.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent / "vectors")
    parser.add_argument(
        "--over",
        choices=("simulated", "zenoh", "dds"),
        help="run the families with a client and a server in two systems that are joined by this transport",
    )
    options = parser.parse_args()
    folder: Path = options.folder
    if not folder.is_dir():
        parser.error(f"{folder} is not a folder")
    if options.over is None:
        return run_folder(folder)
    with crossing.over(options.over):
        failed = run_folder(folder, families=CROSSING)
    numbers = ", ".join(f"{crossing.counts[kind]} {kind}" for kind in ("messages", "calls", "goals"))
    print(f"over {options.over}: {numbers} crossed")
    return failed


if __name__ == "__main__":
    sys.exit(main())
