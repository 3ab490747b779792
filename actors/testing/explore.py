"""The command `python -m actors.testing explore MODULE:TREE`: it runs a tree under many seeds with faults and reports the first failure.

A run fails if

* the tree cannot start, does not reach its end, or gives up,
* a node fails by itself: not killed by a fault, and not with an `ActorError` such as `CallTimeout` while there are faults,
* a handler or a canceled goal is stuck, or tasks wait for each other's locks,
* nothing can run any more, or one step never ends,
* a node does not end when it is asked to, or something is left over after the end,
* an error went unnoticed.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import shlex
import sys
import time
import traceback
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import NoReturn

from actors.errors import NotStarted, described
from actors.running.target import Maker, Unusable, find, grown, grown_hosts
from actors.testing.fault_values import names_nothing, not_come
from actors.testing.faults import KINDS
from actors.testing.lab import Lab
from actors.testing.rig import Rig
from actors.testing.simulation.invariants import PATIENCE
from actors.testing.simulation.isolated import ENDLESS, Elsewhere, Isolated, in_a_copy
from actors.testing.simulation.search import Finding, search
from actors.testing.simulation.trial import Scenario, Trial
from actors.time.virtual_loop import VirtualLoop

SHOWN_LINES = 8
"""The number of log lines shown with a failure, newest last. A replay shows more."""
LIMIT = 300.0
"""How long the start and the stop of a tree may take, in seconds, in addition to the length of a trial."""


def main(argv: Sequence[str]) -> int:
    """Run the command. Returns 0 if every seed passed, 1 for a failure, 2 if the arguments cannot be used."""
    options = _parser().parse_args(argv)
    try:
        replay = Trial.parse(options.replay) if options.replay is not None else None
        make = find(options.tree)
        if replay is None:
            _check_file(Path(options.flight_record))
    except (ValueError, OSError) as error:
        return _refused(error)
    scenario = scenario_of(make, options.seconds, options.patience)
    try:
        return _search(scenario, options) if replay is None else _again(scenario, replay)
    except KeyboardInterrupt:
        print("explore: interrupted", file=sys.stderr)
        return 130


def scenario_of(make: Maker, seconds: float, patience: float = PATIENCE) -> Scenario:
    """Return the scenario that `explore` runs: with a `Lab` if `make` makes trees for several hosts."""
    on_hosts = _is_for_hosts(make)
    body = hosts_body_of(make, seconds) if on_hosts else body_of(make, seconds)
    return Scenario(body, patience=patience, limit=seconds + LIMIT, on_hosts=on_hosts)


def _is_for_hosts(make: Maker) -> bool:
    """Whether trees are made for several hosts; found out in a copy of this process. What cannot be made at all fails in a trial."""

    def work(answer: Callable[[bool], object]) -> None:
        try:
            with asyncio.Runner(loop_factory=VirtualLoop) as runner:
                answer(bool(runner.run(grown_hosts(make))))
        except Exception:
            answer(False)

    try:
        return in_a_copy(work, quiet=True)
    except EOFError:
        return False


def hosts_body_of(make: Maker, seconds: float) -> Callable[[Lab], Awaitable[None]]:
    """Return the scenario for several hosts: it starts the tree of each, lets `seconds` pass, ends the faults of the network, and goes on
    for half as long."""

    async def live(lab: Lab) -> None:
        for host, trees in (await grown_hosts(make)).items():
            await lab.start(host, *trees)
        await lab.advance(seconds)
        await lab.recover()
        await lab.advance(seconds / 2.0)

    return live


def body_of(make: Maker, seconds: float) -> Callable[[Rig], Awaitable[None]]:
    """Return the scenario that `explore` runs: it starts the tree and lets `seconds` pass."""

    async def live(rig: Rig) -> None:
        await rig.start(*await grown(make))
        await rig.advance(seconds)

    return live


def _check_file(path: Path) -> None:
    """Check before a long search that its record can be written. Raises `OSError`."""
    target = path if path.exists() else path.absolute().parent
    if path.is_dir():
        raise IsADirectoryError(f"the flight record cannot be written to {path}: it is a folder")
    if not target.exists() or not os.access(target, os.W_OK):
        raise FileNotFoundError(
            f"the flight record cannot be written to {path}: there is no such folder, or it is not writable"
        )


def _search(scenario: Scenario, options: argparse.Namespace) -> int:
    possible = [fault for kind, fault in KINDS.items() if kind in options.faults]
    begun = time.perf_counter()
    finding = search(Isolated(scenario), range(options.first, options.first + options.seeds), possible)
    took = time.perf_counter() - begun
    if finding is None:
        print(f"{options.tree}: {options.seeds} seeds of {options.seconds:g} s, no failure ({took:.1f} s)")
        return 0
    if finding.outcome.signature[0] == Unusable.__name__:
        return _refused(finding.outcome.error)
    print(f"{options.tree}: {finding.describe()} ({took:.1f} s)")
    print(_explained(finding))
    print(_shortened(finding.outcome.timeline), end="")
    more = "" if options.patience == PATIENCE else f" --patience {options.patience:g}"
    what = (
        f"{shlex.quote(options.tree)} --seconds {options.seconds:g}{more} --replay {shlex.quote(str(finding.replay))}"
    )
    print(f"replay: python -m actors.testing explore {what}")
    print(f"flight record: {_recorded(finding, scenario, options.flight_record)}")
    return 1


def _explained(finding: Finding) -> str:
    """The failure, its place and the faults that led to it, as text."""
    (kind, place), text = finding.outcome.signature, str(finding.outcome.error)
    lines = text.splitlines() if kind in text else f"{kind}: {text}".splitlines()
    if place and place not in text:
        lines.append(f"at {place}")
    return "\n".join(
        f"  {line}" for line in [*lines, *(f"with this fault: {fault.in_words()}" for fault in finding.replay.faults)]
    )


def _shortened(timeline: str) -> str:
    """The newest log lines without tracebacks, one per line; empty if there are none."""
    lines = [line for line in timeline.splitlines() if line.startswith("[")][-SHOWN_LINES:]
    return "".join(f"  {line}\n" for line in [f"the last {len(lines)} log lines:", *lines]) if lines else ""


def _recorded(finding: Finding, scenario: Scenario, file: str) -> str:
    """Write the flight record. Returns its path, or why there is none: a finding is reported in any case."""

    def record(answer: Callable[[str], object]) -> None:
        try:
            answer(str(finding.record(scenario).dump(file)))
        except (NotStarted, OSError) as error:
            answer(f"none: {error}")
        except Exception as error:
            answer(f"none: it could not be written: {described(error)}")

    if finding.outcome.signature[0] in ENDLESS:
        return "none: it is written when a trial ends"
    try:
        return in_a_copy(record, quiet=True)
    except (EOFError, OSError) as error:
        return f"none: {error}"


def _again(scenario: Scenario, trial: Trial) -> int:
    if (mistake := _mistake(scenario, trial)) is not None:
        return _refused(mistake)
    outcome = Isolated(scenario, quiet=False).play(trial)
    error = outcome.error
    if error is None:
        idle = [sentence for fault in trial.faults if (sentence := not_come(fault, outcome.profile))]
        print("\n  ".join(["this trial passes", *idle]))
        return 0
    print(outcome.timeline)
    print(error.report if isinstance(error, Elsewhere) else "".join(traceback.format_exception(error)))
    return 1


def _mistake(scenario: Scenario, trial: Trial) -> BaseException | None:
    """Why a trial cannot be replayed, found in runs without output: there is no tree, or a fault names nothing in it."""
    runs = [Isolated(scenario).play(Trial(0, shuffled=False))]
    if runs[0].error is not None and runs[0].signature[0] == Unusable.__name__:
        return runs[0].error
    if names_nothing(trial.faults, [run.profile for run in runs]):
        runs.append(Isolated(scenario).play(trial))
    profiles = [run.profile for run in runs]
    strange = names_nothing(trial.faults, profiles)
    return Unusable(strange) if strange and all(run.signature[0] not in ENDLESS for run in runs) else None


def _refused(why: BaseException | None) -> int:
    print(f"explore: {why}", file=sys.stderr)
    return 2


def _kinds(text: str) -> list[str]:
    names = [] if text == "none" else text.split(",")
    for name in names:
        if name not in KINDS:
            raise argparse.ArgumentTypeError(f"there is no fault {name!r}; there are: {', '.join(KINDS)}, and none")
    return names


def _whole(least: int) -> Callable[[str], int]:
    """Return a function that reads a whole number not less than `least`."""

    def read(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"give a whole number, {least} or more, not {text!r}")
        return int(text)

    return read


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"give a number of seconds above 0, not {text!r}")
    return seconds


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"explore: {message}\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="python -m actors.testing explore",
        description="Run a tree on virtual time under many seeds: each another legal order of events and other faults.",
    )
    parser.add_argument(
        "tree",
        metavar="MODULE:TREE",
        help="a tree, a node class, a mapping from hosts to trees, or a function without arguments that makes one",
    )
    parser.add_argument("--seeds", type=_whole(1), default=200, help="how many seeds to try (200)")
    parser.add_argument("--first", type=_whole(0), default=0, help="the first seed (0)")
    parser.add_argument("--seconds", type=_seconds, default=30.0, help="simulated seconds of each trial (30)")
    parser.add_argument(
        "--faults",
        type=_kinds,
        default=list(KINDS),
        metavar="KIND,KIND",
        help=f"all by default, or none, or some of: {', '.join(KINDS)}",
    )
    parser.add_argument(
        "--patience",
        type=_seconds,
        default=PATIENCE,
        help=f"seconds after which a handler is taken to be stuck ({PATIENCE:g})",
    )
    parser.add_argument(
        "--flight-record",
        metavar="FILE",
        default="explore.mcap",
        help="where the last 30 s before a failure go (explore.mcap)",
    )
    parser.add_argument("--replay", metavar="TRIAL", help="run one trial, as a failure has printed it")
    return parser
