"""The words of `python -m robot run`: parsed and checked before anything starts. A mistake is one line and exit code 2."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, radians
from typing import Any, Literal

__all__ = ["Crash", "Options", "UsageError", "parse"]


class UsageError(Exception):
    """The command line, or what it names, cannot be used; the text is one line for the user."""


@dataclass(frozen=True, slots=True)
class Crash:
    """``--crash NODE@T``: make the node fail, at that many seconds."""

    node: str
    at: float


@dataclass(frozen=True, slots=True)
class Options:
    """Everything a run can be told."""

    duration: float | None
    battery: float
    crashes: tuple[Crash, ...]
    clock: Literal["real", "virtual"]
    world: str
    backend: Literal["physics", "kinematic"]
    seed: int
    goal: tuple[float, float, float] | None
    params: str | None
    log_format: Literal["console", "json"]
    log_level: str
    report: str | None
    motor_delay: float


def parse(argv: Sequence[str]) -> Options:
    """Raises `UsageError`; `--help` and grammar mistakes end in argparse's own way (exit 0 and 2)."""
    given = _parser().parse_args(argv)
    return Options(
        duration=given.duration,
        battery=_within("--battery", given.battery, 0.0, 100.0, "per cent"),
        crashes=tuple(_crash(text) for text in given.crash),
        clock=given.clock,
        world=given.world,
        backend=given.backend,
        seed=given.seed,
        goal=_goal(given.goal),
        params=given.params,
        log_format=given.log_format,
        log_level=given.log_level,
        report=_writable(given.report),
        motor_delay=_within("--motor-delay", given.motor_delay, 0.0, 20.0, "milliseconds") / 1e3,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m robot run",
        description="Run the whole robot in a world: it stands up, walks its patrol, reports battery and pose, docks when low, and sits when told to stop.",
    )
    add: Any = parser.add_argument
    add(
        "--duration",
        type=seconds,
        metavar="S",
        help="end after S seconds (default: run until Ctrl-C; 120 on the virtual clock)",
    )
    add("--battery", type=float, default=90.0, metavar="PERCENT", help="charge at the start (default 90)")
    add(
        "--crash",
        action="append",
        default=[],
        metavar="NODE@T",
        help="make NODE fail at T seconds; may be given several times",
    )
    add(
        "--clock",
        choices=("real", "virtual"),
        default="real",
        help="real time, or as fast as the machine can (default real)",
    )
    add(
        "--world", default="warehouse", metavar="NAME", help="warehouse, empty, corridor or pillars (default warehouse)"
    )
    add(
        "--backend",
        choices=("physics", "kinematic"),
        default="physics",
        help="MuJoCo, or numpy only, which cannot fall",
    )
    add("--seed", type=int, default=0, metavar="N", help="of all noise and randomness (default 0)")
    add(
        "--goal",
        type=float,
        nargs="+",
        metavar="X",
        help="X Y [THETA]: walk there once (m, m, rad) instead of the patrol, then sit and end",
    )
    add("--params", metavar="FILE", help="a ROS 2 parameter file (YAML)")
    add("--log-format", choices=("console", "json"), default="console")
    add("--log-level", choices=("debug", "info", "warn", "error", "fatal"), default="info")
    add("--report", metavar="FILE", help="write a report of the run as JSON")
    add(
        "--motor-delay",
        type=float,
        default=4.0,
        metavar="MS",
        help="delay of the motor drives in milliseconds, 0 to 20 (default 4)",
    )
    return parser


def seconds(text: str) -> float:
    """A positive number of seconds, for argparse."""
    value = float(text)
    if not isfinite(value) or value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number of seconds")
    return value


def _within(option: str, value: float, low: float, high: float, unit: str) -> float:
    if not low <= value <= high:  # also false for NaN
        raise UsageError(f"{option} {value:g}: give {low:g} to {high:g} {unit}")
    return value


def _crash(text: str) -> Crash:
    node, mark, at = text.rpartition("@")
    try:
        seconds = float(at)
    except ValueError:
        seconds = -1.0
    if not mark or not node or not isfinite(seconds) or seconds < 0.0:
        raise UsageError(f"--crash {text}: write NODE@SECONDS, such as navigation@10")
    return Crash(node, seconds)


def _goal(values: Sequence[float] | None) -> tuple[float, float, float] | None:
    if values is None:
        return None
    if len(values) not in (2, 3):
        raise UsageError(f"--goal takes X Y or X Y THETA, not {len(values)} numbers")
    x, y, theta = (*values, 0.0)[:3]
    for name, value in (("X", x), ("Y", y), ("THETA", theta)):
        if not isfinite(value):
            raise UsageError(f"--goal: {name} is {value}, which is not a finite number")
    if abs(theta) > radians(360):
        raise UsageError(f"--goal: THETA is {theta:g} rad; give an angle within one turn, in radians")
    return x, y, theta


def _writable(path: str | None) -> str | None:
    if path is not None:
        folder = os.path.dirname(os.path.abspath(path))
        if not os.path.isdir(folder) or os.path.isdir(path):
            raise UsageError(
                f"--report {path}: there is no folder {folder} to write it in"
                if not os.path.isdir(folder)
                else f"--report {path}: that is a folder"
            )
    return path
