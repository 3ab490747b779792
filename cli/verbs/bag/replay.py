"""`bag replay`: play the journal of a node or subtree to that alone, and compare what it sends with the recording."""

from __future__ import annotations

import argparse
import importlib
import json
import re
import sys
import time
from pathlib import Path
from typing import Any

from actors import Node
from actors.parameters.text import parse_parameter
from actors.replay import Recording, Verdict, load, recording_in, replay
from actors.replay.recording import is_subtree, named
from cli.command import CommandFailed
from cli.graph.types import learn_folders

PLACE = re.compile(r"(?P<topic>[^\[\]]+)(\[(?P<number>\d+)\])?")


def run(options: argparse.Namespace) -> int:
    """Replay a journal; the exit code is 0 if the node did the same, as far as that can be said, and 1 if not."""
    learn_folders(options)
    sys.path.insert(0, "")  # the node may be one of this folder
    _check_path(options)
    given: dict[str, Any] = {
        "parameters": dict(_parameter(one) for one in options.set),
        "pause": None if options.pause is None else _place(options.pause),
    }
    begun = time.perf_counter()
    recording = _recording(options)
    if options.cost:
        return _cost(recording)
    node = None if options.node_class is None else _node(options.node_class)
    changed = options.node if is_subtree(recording.node) else None
    verdict = replay(recording, changed=changed, node=node, every=options.all, **given)
    _tell(verdict, options.json, time.perf_counter() - begun)
    return 0 if verdict.equal else 1


def _check_path(options: argparse.Namespace) -> None:
    path: Path = options.path
    if not path.exists():
        raise CommandFailed(f"there is no bag and no journal {path}")
    if _is_bag(path) and options.node is None and options.subtree is None:
        raise CommandFailed(f"{path} is a bag: say which node with --node NODE, or which nodes with --subtree PATH")


def _is_bag(path: Path) -> bool:
    return path.is_dir() or path.suffix in (".mcap", ".db3")


def _recording(options: argparse.Namespace) -> Recording:
    """The journal of the node or subtree. Raises `NoJournal` for a bag that has none."""
    path, asked = options.path, options.subtree or options.node
    if _is_bag(path):
        return recording_in(path, asked, trust=options.trust)
    recording = load(path, trust=options.trust)
    meant = options.subtree if is_subtree(recording.node) else asked
    if meant is not None and named([recording.node], meant) is None:
        raise CommandFailed(f"{path} is the journal of {recording.node}, not of {meant}")
    return recording


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
            "lacking": verdict.lacking,
            "failure": verdict.failure,
            "differences": [*map(str, verdict.differences)],
            "inner": [*map(str, verdict.inner)],
            "other_versions": verdict.other_versions,
        }
        print(json.dumps(facts))
        return
    if verdict.other_versions:
        print(f"not as it was recorded: {', '.join(verdict.other_versions)}")
    for difference in verdict.inner:
        print(f"inside: {difference}")
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


def _cost(recording: Recording) -> int:
    """Print what a journal holds, and how large it is."""
    from actors.replay.parts import pack

    size, kinds = len(pack(0, recording.entries)), recording.counts()
    for kind, count in sorted(kinds.items(), key=lambda one: -one[1]):
        print(f"{count:>9}  {kind}")
    seconds = recording.seconds
    print(
        f"{sum(kinds.values())} entries, {size} bytes, for {seconds:.1f} s of {recording.node}: {size / max(seconds, 1e-9) / 1e3:.1f} kB/s"
    )
    return 0
