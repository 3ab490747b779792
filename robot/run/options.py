"""The words of `python -m robot run`: parsed and checked before anything starts. A mistake is one line and exit code 2."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any, Literal, NoReturn

from actors.suggest import did_you_mean
from robot.run.errands import Crash, Fetch, Goal, Hang, UsageError, parse_fault, parse_fetch, parse_goal
from robot.scenes.worlds import WORLDS

__all__ = [
    "LEVELS", "VIRTUAL_DURATION", "Crash", "Fetch", "Goal", "Hang", "Options", "Parser", "UsageError", "parse", "parse_fetch", "parse_goal",
    "parse_seed", "seconds", "whole", "within",
]  # fmt: skip

LEVELS = ("debug", "info", "warn", "error", "fatal")
"""What may be said for `--log-level`."""
VIRTUAL_DURATION = 120.0
"""A run on the virtual clock needs an end; this is its default, seconds."""


class Parser(argparse.ArgumentParser):
    """argparse, but a mistake is one `UsageError` that says where the help is, instead of a page; a misspelt option is told the closest one."""

    def error(self, message: str) -> NoReturn:
        if message.startswith("unrecognized arguments: "):
            known = [option for action in self._actions for option in action.option_strings]
            near = (did_you_mean(word.partition("=")[0], known, quoted=False) for word in message.split()[2:])
            message += next(filter(None, near), "")
        raise UsageError(f"{message} (see {self.prog} --help)")


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
    goal: Goal | None
    params: str | None
    log_format: Literal["console", "json"]
    log_level: str
    report: str | None
    motor_delay: float
    flight_record: str | None
    trace: bool
    publish_clock: float | None
    only: tuple[str, ...]
    """The nodes to run; empty: all of them."""
    arm: bool
    fetch: Fetch | None
    listen: tuple[str, ...] = ()
    """The endpoints where other machines connect to."""
    connect: tuple[str, ...] = ()
    """The endpoints of other machines to connect to."""
    processes: bool = False
    """Whether the body and each concern of the tree have a process of their own."""
    hangs: tuple[Hang, ...] = ()
    security: str | None = None
    """A security file."""
    replay: tuple[str, ...] = ()
    """The nodes of which journals are kept."""


def parse(argv: Sequence[str]) -> Options:
    """Raises `UsageError`; `--help` ends in argparse's own way (exit 0)."""
    given = _parser().parse_args(argv)
    if given.trace and given.clock != "virtual":
        raise UsageError("--trace: two runs are equal on the virtual clock only; add --clock virtual")
    if given.clock == "virtual" and (given.listen or given.connect or given.security):
        raise UsageError("--listen, --connect, --security: other machines live in real time; leave out --clock virtual")
    if given.publish_clock is not None:
        _within("--publish-clock", given.publish_clock, 0.1, 1000.0, "Hz")
    if given.processes and given.clock == "virtual":
        raise UsageError("--processes: processes live in real time; leave out --clock virtual")
    if given.processes and given.backend == "kinematic":
        raise UsageError("--processes: only the physics body has a process of its own; leave out --backend kinematic")
    if given.processes and given.replay:
        raise UsageError("--replay: journals are kept of nodes of this process; leave out --processes")
    if given.hang and not given.processes:
        raise UsageError("--hang: in one process everything would hang, and nobody be left to see it; add --processes")
    duration = given.duration
    if duration is None and given.clock == "virtual":
        duration = VIRTUAL_DURATION
    return Options(
        duration=duration,
        battery=_within("--battery", given.battery, 0.0, 100.0, "per cent"),
        crashes=tuple(Crash(*parse_fault("--crash", text, duration)) for text in given.crash),
        clock=given.clock,
        world=given.world,
        backend=given.backend,
        seed=given.seed,
        goal=parse_goal(given.goal),
        params=given.params,
        log_format=given.log_format,
        log_level=given.log_level,
        report=_writable("--report", given.report),
        motor_delay=_within("--motor-delay", given.motor_delay, 0.0, 20.0, "milliseconds") / 1e3,
        flight_record=_regular("--flight-record", _writable("--flight-record", given.flight_record)),
        trace=given.trace,
        publish_clock=given.publish_clock,
        only=_names(given.only),
        arm=given.arm or given.fetch is not None,
        fetch=parse_fetch(given.fetch, given.goal),
        listen=tuple(given.listen),
        connect=tuple(given.connect),
        processes=given.processes,
        hangs=tuple(Hang(*parse_fault("--hang", text, duration)) for text in given.hang),
        security=given.security,
        replay=_names(given.replay),
    )


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="python -m robot run",
        description="Run the whole robot in a world: it stands up, walks its patrol, reports battery and pose, docks when low, and sits when told to stop.",
    )
    _add_circumstances(parser.add_argument)
    _add_network(parser.add_argument)
    _add_errand(parser.add_argument)
    _add_output(parser.add_argument)
    return parser


def _add_circumstances(add: Any) -> None:
    """How long, where and with what body."""
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
        "--hang",
        action="append",
        default=[],
        metavar="NODE@T",
        help="with --processes: make the process of NODE stand still at T seconds; may be given several times",
    )
    add(
        "--processes",
        action="store_true",
        help="run the body and each concern of the robot (control, safety, perception, ...) in a process of its own; a process that dies is "
        "restarted",
    )
    add(
        "--clock",
        choices=("real", "virtual"),
        default="real",
        help="real time, or as fast as the machine can (default real)",
    )
    add("--world", default=WORLDS[0], metavar="NAME", help=f"{', '.join(WORLDS)} (default {WORLDS[0]})")
    add(
        "--backend",
        choices=("physics", "kinematic"),
        default="physics",
        help="MuJoCo, or numpy only, which cannot fall",
    )
    add("--seed", type=parse_seed, default=0, metavar="N", help="of all noise and randomness (default 0)")


def _add_network(add: Any) -> None:
    """Where other processes are."""
    add(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="take part in the graph of another machine, tcp/HOST:7447; processes of this one find each other by themselves",
    )
    add(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="let other machines connect to tcp/0.0.0.0:PORT",
    )
    add("--security", metavar="FILE", help="TLS, and who may do what (docs/security.md)")


def _add_errand(add: Any) -> None:
    """What is to be done, and by which nodes."""
    add(
        "--goal",
        type=float,
        nargs="+",
        metavar="X",
        help="X Y [THETA]: walk there once (m, m, rad) instead of the patrol, then sit and end",
    )
    add(
        "--only",
        nargs="+",
        metavar="NODE",
        help="run just these nodes of the robot (names divided by spaces or commas). Each one starts without the others and takes "
        "up work with those that come later, in this process or another",
    )
    add("--arm", action="store_true", help="carry an arm of 6.2 kg, and all that belongs to it")
    add(
        "--fetch",
        nargs="+",
        metavar="NAME",
        help="NAME [X Y [Z]]: fetch that thing of the world instead of walking the patrol, and carry it to X Y Z (m; Z is 0 unless "
        "given); with an arm, of course. In the kitchen: --world kitchen --fetch cup 1.9 -1 0.4",
    )


def _add_output(add: Any) -> None:
    """Parameters, and what is written down."""
    add("--params", metavar="FILE", help="a ROS 2 parameter file (YAML)")
    add("--log-format", choices=("console", "json"), default="console")
    add("--log-level", type=str.lower, choices=LEVELS, default="info")
    add("--report", metavar="FILE", help="write a report of the run as JSON")
    add(
        "--replay",
        metavar="NODES",
        help="keep journals of these nodes (names with commas between), on topics NODE/_journal, for `bag record --replay` and `bag replay`",
    )
    add(
        "--flight-record",
        metavar="FILE",
        help="keep the last 30 s of all messages, log lines and supervisor events, and write them to FILE (MCAP) when the "
        "run ends or a supervisor gives up; after a fall, those that led to it",
    )
    add(
        "--trace",
        action="store_true",
        help="print one hash over all messages, log lines and supervisor events: equal for equal runs on the virtual clock",
    )
    add(
        "--publish-clock",
        type=float,
        nargs="?",
        const=40.0,
        metavar="HZ",
        help="publish the run's time on /clock for nodes with use_sim_time, HZ times a second (default 40)",
    )
    add(
        "--motor-delay",
        type=float,
        default=4.0,
        metavar="MS",
        help="delay of the motor drives in milliseconds, 0 to 20 (default 4)",
    )


def parse_seed(text: str) -> int:
    """A seed of random numbers, for argparse: a whole number that is not negative."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is no seed: give a whole number of at least 0")
    return value


def within(low: float, high: float, unit: str) -> Callable[[str], float]:
    """A number within bounds, for argparse."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not low <= value <= high:  # also true for NaN
            raise argparse.ArgumentTypeError(f"{text}: give {low:g} to {high:g} {unit}")
        return value

    return parse


def whole(low: int, high: int) -> Callable[[str], int]:
    """A whole number within bounds, for argparse."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text}: give a whole number from {low} to {high}")
        return value

    return parse


def seconds(text: str) -> float:
    """A positive number of seconds, for argparse."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not isfinite(value) or value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number of seconds")
    return value


def _within(option: str, value: float, low: float, high: float, unit: str) -> float:
    if not low <= value <= high:  # also false for NaN
        raise UsageError(f"{option} {value:g}: give {low:g} to {high:g} {unit}")
    return value


def _names(words: Sequence[str] | None) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name for word in words or () for name in word.split(",") if name))
    if words is not None and not names:
        raise UsageError("--only: name at least one node, such as --only gait")
    return names


def _writable(option: str, path: str | None) -> str | None:
    """The path, if a file can be written there as far as can be seen without writing one. Raises `UsageError`."""
    if path is None:
        return None
    folder = os.path.dirname(os.path.abspath(path))
    if not path:
        raise UsageError(f"{option}: name a file")
    if not os.path.isdir(folder):
        raise UsageError(f"{option} {path}: there is no folder {folder} to write it in")
    if os.path.isdir(path):
        raise UsageError(f"{option} {path}: that is a folder")
    if not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise UsageError(f"{option} {path}: no permission to write it")
    return path


def _regular(option: str, path: str | None) -> str | None:
    """Refuse devices and pipes: the file is written beside its place and then put there, which would take the device away."""
    if path is not None and os.path.exists(path) and not os.path.isfile(path):
        raise UsageError(f"{option} {path}: that is no regular file")
    return path
