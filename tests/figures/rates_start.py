"""The start of `tests.figures rates`: from the command `python -m robot run` to a robot whose nodes are all ready."""

from __future__ import annotations

import subprocess
import sys
from time import perf_counter
from typing import NamedTuple

from tests.figures.load import family, processor_seconds


class Start(NamedTuple):
    """How long one start took, in seconds; `processor` is the time of all its processes together."""

    wall: float
    processor: float


def start_robot(seed: int, *words: str) -> Start:
    """Start the robot once, with these words after those of every run; it sits down at once."""
    command = [sys.executable, "-m", "robot", "run", "--world", "warehouse", "--duration", "0.01", "--seed", str(seed)]
    began = perf_counter()
    with subprocess.Popen([*command, *words], stderr=subprocess.PIPE, text=True) as run:
        assert run.stderr is not None
        for line in run.stderr:
            if "robot running" in line:
                found = Start(perf_counter() - began, processor_seconds(family(run.pid)))
                run.communicate()
                return found
    raise RuntimeError(f"the robot did not start: {' '.join(command)} exited with {run.returncode}")
