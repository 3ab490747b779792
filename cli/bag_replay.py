"""`bag replay`: play the journal of one node to that node alone, and compare what it sends with the recording."""

from __future__ import annotations

import argparse
import importlib
import json
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from actors import Node
from actors.parameters.text import parse_parameter
from actors.replay import Tape, Verdict, load, replay, tape_in
from cli.command import CommandFailed

__all__ = ["run"]

PLACE = re.compile(r"(?P<topic>[^\[\]]+)(\[(?P<number>\d+)\])?")


def run(verb: str, argv: Sequence[str]) -> int:
    """Replay it; the exit code is 0 if the node did the same, 1 if not."""
    options = _parser().parse_args(argv)
    sys.path.insert(0, "")  # the node may be one of this folder
    tape = _tape(options.path, options.node)
    if options.cost:
        return _cost(tape)
    begun = time.perf_counter()
    verdict = replay(
        tape,
        node=None if options.node_class is None else _node(options.node_class),
        parameters=dict(_parameter(one) for one in options.set),
        pause=None if options.pause is None else _place(options.pause),
        every=options.all,
    )
    _tell(verdict, options.json, time.perf_counter() - begun)
    return 0 if verdict.equal else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m robot bag replay",
        description="Play the journal of one node to that node alone, on virtual time, and compare what it sends with the recording. "
        "A journal can run any code when it is loaded: replay only what you trust.",
    )
    parser.add_argument("path", type=Path, metavar="FILE", help="a bag with a journal, or the file of a journal")
    parser.add_argument("--node", metavar="NODE", help="whose journal, by its name; needed with a bag")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PARAM=VALUE",
        help="start the node with this value, and go on behind differences",
    )
    parser.add_argument(
        "--with",
        dest="node_class",
        metavar="MODULE:NODE",
        help="play to this class instead, and go on behind differences",
    )
    parser.add_argument(
        "--break", dest="pause", metavar="TOPIC[N]", help="stop in a debugger where message N (from 0) is sent on TOPIC"
    )
    parser.add_argument("--all", action="store_true", help="go on behind the first difference")
    parser.add_argument("--cost", action="store_true", help="only print what the journal holds and costs")
    parser.add_argument("--json", action="store_true", help="as JSON")
    return parser


def _tape(path: Path, node: str | None) -> Tape:
    if not path.exists():
        raise CommandFailed(f"there is no bag and no journal {path}")
    if path.is_dir() or path.suffix in (".mcap", ".db3"):
        if node is None:
            raise CommandFailed(f"{path} is a bag: say which node's journal with --node NODE")
        return tape_in(path, node)
    tape = load(path)
    if node is not None and node not in (tape.node, tape.node.rpartition("/")[2]):
        raise CommandFailed(f"{path} is the journal of {tape.node}, not of {node}")
    return tape


def _node(text: str) -> type[Node]:
    module, _, name = text.partition(":")
    try:
        found: Any = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise CommandFailed(f"--with {text}: {error}; give the class as MODULE:NODE") from error
    if not (isinstance(found, type) and issubclass(found, Node)):
        raise CommandFailed(f"--with {text}: that is no class of a node")
    return found


def _parameter(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals:
        raise CommandFailed(f"--set {text}: give it as PARAM=VALUE")
    try:
        return name, parse_parameter(name, value).value
    except ValueError as error:
        raise CommandFailed(f"--set {text}: {error}") from error


def _place(text: str) -> tuple[str, int]:
    place = PLACE.fullmatch(text)
    if place is None:
        raise CommandFailed(f"--break {text}: give it as TOPIC[N], for example /cmd_vel[12]")
    topic = place["topic"]
    return topic if topic.startswith("/") else f"/{topic}", int(place["number"] or 0)


def _tell(verdict: Verdict, as_json: bool, seconds: float) -> None:
    if as_json:
        facts = {
            "node": verdict.node,
            "equal": verdict.equal,
            "compared": verdict.compared,
            "seconds": round(seconds, 3),
        }
        facts |= {
            "lacking": verdict.lacking,
            "failure": verdict.failure,
            "differences": [*map(str, verdict.differences)],
        }
        print(json.dumps(facts))
        return
    for difference in verdict.differences:
        print(difference)
    if verdict.lacking:
        print(f"the replay ended early: {verdict.lacking}")
    if verdict.failure:
        print(f"the node ended with {verdict.failure}")
    word = "equal" if verdict.equal else "not equal"
    print(
        f"{verdict.node}: {word}; {verdict.compared} messages, calls, answers and log lines compared in {seconds:.1f} s"
    )


def _cost(tape: Tape) -> int:
    """Print what a journal holds, and how large it is."""
    from actors.replay.tape import pack

    size, kinds = len(pack(tape.entries)), tape.counts()
    for kind, count in sorted(kinds.items(), key=lambda one: -one[1]):
        print(f"{count:>9}  {kind}")
    seconds = tape.seconds
    print(
        f"{sum(kinds.values())} entries, {size} bytes uncompressed, for {seconds:.1f} s of {tape.node}: {size / max(seconds, 1e-9) / 1e3:.1f} kB/s"
    )
    return 0
