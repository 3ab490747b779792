"""What all measurements share: a line of help, options of their own, and a result that is printed as text or as JSON."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cli.parsing import Parser
from robot.run.arguments import whole

PROGRAM = "python -m tests.figures"


class Result(NamedTuple):
    """What was measured."""

    values: Mapping[str, Any]
    """All of it, as JSON can hold it, without the circumstances."""
    show: Callable[[Mapping[str, Any]], str]
    """The text for values and circumstances."""
    good: bool = True
    """Whether every bound is kept."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One group of figures."""

    name: str
    help: str
    takes: str
    """How long all of it takes, in words."""
    arguments: Callable[[ArgumentParser], object]
    take: Callable[[Namespace], Result]
    """Measure; says on stderr how far it is. Raises `UsageError`, `BackendMissing`."""

    def parser(self) -> Parser:
        """Its options, and --json."""
        made = Parser(prog=f"{PROGRAM} {self.name}", description=self.help, epilog=f"All of it takes {self.takes}.")
        self.arguments(made)
        made.add_argument("--json", action="store_true", help="print JSON instead of text")
        return made


def add_running(parser: ArgumentParser) -> None:
    """Add --jobs and --resume."""
    parser.add_argument("--jobs", type=whole(1, 256), default=1, metavar="N", help="processes (default 1)")
    parser.add_argument(
        "--resume", type=Path, metavar="FILE", help="keep each outcome here, and do not run again what is kept"
    )


def heading(result: Mapping[str, Any], many: int | None = None) -> str:
    """The circumstances as a line; with the seeds, where there are so `many` trials of one each."""
    here = result["machine"]
    seeds = "" if many is None else f"seeds {result['seed']} to {result['seed'] + many - 1}; "
    return (
        f"{seeds}{result['date']}; {here['processor']}, {here['cores']} cores, Python {here['python']}, MuJoCo {here['mujoco']}; "
        f"{result['wall_seconds']:.0f} s"
    )
