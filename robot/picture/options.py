"""The words of `python -m robot picture`: parsed and checked before anything runs. A mistake is one line and exit code 2."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

from cli.command import UsageError
from cli.parsing import Parser
from robot.run.arguments import parse_seed
from robot.run.tasks import Fetch, Goal, parse_fetch, parse_goal
from robot.scenes.worlds import WORLDS

SMALLEST, LARGEST = (64, 64), (4096, 4096)
"""Width and height in pixels."""
LONGEST = 3600.0


@dataclass(frozen=True, slots=True)
class Options:
    """Everything a picture can be told."""

    file: str
    world: str
    seed: int
    at: float | None
    """When, s; `None`: when this world has something to show."""
    size: tuple[int, int]
    backend: Literal["physics", "kinematic"]
    renderer: Literal["builtin", "mujoco"]
    arm: bool
    goal: Goal | None
    fetch: Fetch | None


def parse(argv: Sequence[str]) -> Options:
    """Raises `UsageError`; `--help` ends in argparse's own way (exit 0)."""
    given = _parser().parse_args(argv)
    if given.renderer == "mujoco" and (given.arm or given.fetch):
        raise UsageError("--renderer mujoco draws no arm: leave it out, or --arm and --fetch")
    return Options(
        file=_writable(given.file),
        world=given.world,
        seed=given.seed,
        at=_at(given.at),
        size=_size(given.size),
        backend=given.backend,
        renderer=given.renderer,
        arm=given.arm,
        goal=parse_goal(given.goal),
        fetch=parse_fetch(given.fetch, given.goal),
    )


def _parser() -> Parser:
    parser = Parser(
        prog="robactor picture",
        description="Run the whole robot, catch it in mid-stride and draw it to a PNG file; same seed, same picture.",
    )
    add: Any = parser.add_argument
    add("file", nargs="?", default="robot.png", metavar="FILE", help="the PNG file to write (default robot.png)")
    add("--world", default=WORLDS[0], metavar="NAME", help=f"{', '.join(WORLDS)} (default {WORLDS[0]})")
    add("--seed", type=parse_seed, default=0, metavar="N", help="of all noise and randomness (default 0)")
    add(
        "--at",
        type=float,
        metavar="SECONDS",
        help="when: it is caught at the next mid-stride, within half a second (default 24; 5 in a world with things, beside them)",
    )
    add("--arm", action="store_true", help="carry an arm")
    add("--goal", type=float, nargs="+", metavar="X", help="X Y [THETA]: walk there instead of the patrol (m, m, rad)")
    add(
        "--fetch",
        nargs="+",
        metavar="NAME",
        help="NAME [X Y [Z]]: fetch that thing instead of the patrol, and carry it to X Y Z (m), such as "
        "--world kitchen --fetch cup --at 14",
    )
    add("--size", default="1200x675", metavar="WxH", help="width and height in pixels (default 1200x675)")
    add(
        "--backend",
        choices=("physics", "kinematic"),
        default="physics",
        help="the body that is run: MuJoCo, or numpy only, which cannot fall (default physics)",
    )
    add(
        "--renderer",
        choices=("builtin", "mujoco"),
        default="builtin",
        help="what draws the robot: numpy, or MuJoCo, which needs OpenGL (default builtin)",
    )
    return parser


def _at(seconds: float | None) -> float | None:
    if seconds is not None and not (isfinite(seconds) and 0.0 <= seconds <= LONGEST):
        raise UsageError(f"--at {seconds:g}: give 0 to {LONGEST:g} seconds")
    return seconds


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if match is None:
        raise UsageError(f"--size {text}: write WIDTHxHEIGHT in pixels, such as 1200x675")
    size = int(match[1]), int(match[2])
    if not all(low <= side <= high for low, side, high in zip(SMALLEST, size, LARGEST, strict=True)):
        raise UsageError(f"--size {text}: give {SMALLEST[0]}x{SMALLEST[1]} to {LARGEST[0]}x{LARGEST[1]}")
    return size


def _writable(path: str) -> str:
    """The path, if a file can be written there as far as can be seen without writing one."""
    folder = os.path.dirname(os.path.abspath(path))
    if os.path.isdir(path):
        raise UsageError(f"{path}: that is a folder; name a file")
    if os.path.splitext(path)[1].lower() != ".png":
        raise UsageError(f"{path}: pictures are written as PNG; give it a name that ends in .png")
    if not os.path.isdir(folder):
        raise UsageError(f"{path}: there is no folder {folder} to write it in")
    if not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise UsageError(f"{path}: no permission to write it")
    return path
