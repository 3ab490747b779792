"""`python -m tests.conformance FOLDER`: run every vector file of a folder for which there is a check module."""

import argparse
import sys
from pathlib import Path

from tests.conformance.runner import run_folder


def main() -> int:
    """Exit status: 0 when no core case failed, 1 otherwise or when the folder holds no vectors, 2 for wrong usage."""
    parser = argparse.ArgumentParser(prog="python -m tests.conformance", description="Run conformance vectors.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent / "vectors")
    folder: Path = parser.parse_args().folder
    if not folder.is_dir():
        parser.error(f"{folder} is not a folder")
    return run_folder(folder)


if __name__ == "__main__":
    sys.exit(main())
