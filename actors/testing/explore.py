"""`python -m actors.testing explore MODULE:TREE`: runs a tree under many seeds with faults, and reports the first failure.

What counts as one: the tree cannot start, or gives up; a node fails by itself (not because a fault killed it, nor with an `ActorError`
such as `CallTimeout` while there are faults); a handler or a canceled goal is stuck; nothing can run any more; a node does not end when it
is asked to; something is left after the end; an error that nobody took notice of.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, cast

from actors.bag import FlightRecorder
from actors.node import Node
from actors.supervisor import Child, DynamicSupervisor, Supervisor
from actors.testing.faults import KINDS
from actors.testing.rig import Rig
from actors.testing.simulation.invariants import PATIENCE
from actors.testing.simulation.search import Finding, Replay, search
from actors.testing.simulation.trial import Outcome, Scenario

__all__ = ["main"]

Tree = Supervisor | DynamicSupervisor | Child | type[Node]


def main(argv: Sequence[str]) -> int:
    """The command. 0 when every seed passed, 1 for a failure, 2 for what cannot be run."""
    options = _parser().parse_args(argv)
    try:
        make = _find(options.tree)
        replay = Replay.parse(options.replay) if options.replay is not None else None
    except (ValueError, ImportError) as error:
        print(f"explore: {error}", file=sys.stderr)
        return 2
    scenario = Scenario(_body(make, options.seconds), patience=options.patience)
    possible = [fault for kind, fault in KINDS.items() if kind in options.faults]
    if replay is not None:
        return _report_one(replay.run(scenario))
    begun = time.perf_counter()
    finding = search(scenario, range(options.first, options.first + options.seeds), possible)
    took = time.perf_counter() - begun
    if finding is None:
        print(f"{options.tree}: {options.seeds} seeds of {options.seconds:g} s, no failure ({took:.1f} s)")
        return 0
    _report(finding, scenario, options, took)
    return 1


def _body(make: Callable[[], Tree], seconds: float) -> Callable[[Rig], Any]:
    async def live(rig: Rig) -> None:
        await rig.start(make())
        await rig.advance(seconds)

    return live


def _find(name: str) -> Callable[[], Tree]:
    """``MODULE:TREE``: a tree, a child, a node class, or a function without arguments that makes one."""
    module, _, attribute = name.partition(":")
    if not module or not attribute:
        raise ValueError(f"{name!r}: write MODULE:TREE, such as my_robot.tree:tree")
    sys.path.insert(0, os.getcwd())
    found: object = getattr(importlib.import_module(module), attribute, None)
    if isinstance(found, (Supervisor, DynamicSupervisor, Child)):
        return lambda: found
    if isinstance(found, type):
        if issubclass(found, Node):
            return lambda: found
    elif callable(found):
        return cast("Callable[[], Tree]", found)
    raise ValueError(f"{name!r}: {module} has no tree, node class or function of the name {attribute!r}")


def _report(finding: Finding, scenario: Scenario, options: argparse.Namespace, took: float) -> None:
    error = finding.outcome.error
    print(f"{options.tree}: {finding.describe()}, found and shrunk in {finding.trials} trials ({took:.1f} s)")
    print(f"  {type(error).__name__}: {error}")
    recorder = FlightRecorder()
    finding.replay.run(replace(scenario, observers=(recorder.attach,)))
    print(f"flight record: {recorder.dump(options.flight_record)}")
    more = "" if options.patience == PATIENCE else f" --patience {options.patience:g}"
    print(
        f"replay: python -m actors.testing explore {options.tree} --seconds {options.seconds:g}{more} --replay '{finding.replay}'"
    )


def _report_one(outcome: Outcome) -> int:
    if outcome.error is None:
        print("this trial passes")
        return 0
    print(outcome.timeline)
    traceback.print_exception(outcome.error, file=sys.stdout)
    return 1


def _kinds(text: str) -> list[str]:
    names = [] if text == "none" else text.split(",")
    for name in names:
        if name not in KINDS:
            raise argparse.ArgumentTypeError(f"there is no fault {name!r}; there are: {', '.join(KINDS)}, and none")
    return names


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m actors.testing explore",
        description="Run a tree on virtual time under many seeds: each another legal order of events and other faults.",
    )
    parser.add_argument("tree", metavar="MODULE:TREE", help="a tree, a node class, or a function that makes a tree")
    parser.add_argument("--seeds", type=int, default=200, help="how many seeds to try (200)")
    parser.add_argument("--first", type=int, default=0, help="the first seed (0)")
    parser.add_argument("--seconds", type=float, default=30.0, help="simulated seconds of each trial (30)")
    parser.add_argument(
        "--faults",
        type=_kinds,
        default=list(KINDS),
        metavar="KIND,KIND",
        help=f"all by default, or none, or some of: {', '.join(KINDS)}",
    )
    parser.add_argument(
        "--patience",
        type=float,
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
