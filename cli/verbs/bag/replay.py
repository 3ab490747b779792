"""`bag replay`: play the journal of a node or subtree, or the topics of a bag, to that alone, and compare what it sends with the recording."""

from __future__ import annotations

import argparse
import asyncio
import importlib
import json
import re
import sys
import time
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from actors import Child, Node, Supervisor
from actors.launch.packages import GROUP
from actors.parameters.text import parse_parameter
from actors.replay import NoJournal, Tape, TopicsVerdict, Verdict, load, replay, replay_topics, tape_in
from actors.replay.tape import is_subtree, named
from actors.running.target import Unusable, find, grown
from actors.suggest import did_you_mean
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
    try:
        tape = _tape(options)
    except NoJournal as error:
        if options.cost or options.subtree is not None:
            raise
        shown = replay_topics(options.path, _declared(options, str(error)), **given)
        _tell_topics(shown, options.json, time.perf_counter() - begun)
        return 0 if shown.equal else 1
    if options.cost:
        return _cost(tape)
    node = None if options.node_class is None else _node(options.node_class)
    changed = options.node if is_subtree(tape.node) else None
    verdict = replay(tape, changed=changed, node=node, every=options.all, **given)
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


def _tape(options: argparse.Namespace) -> Tape:
    """The journal of the node or subtree. Raises `NoJournal` for a bag that has none, so that its topics are to be played."""
    path, asked = options.path, options.subtree or options.node
    if _is_bag(path):
        return tape_in(path, asked, trust=options.trust)
    tape = load(path, trust=options.trust)
    meant = options.subtree if is_subtree(tape.node) else asked
    if meant is not None and named([tape.node], meant) is None:
        raise CommandFailed(f"{path} is the journal of {tape.node}, not of {meant}")
    return tape


def _declared(options: argparse.Namespace, missing: str) -> Child:
    """The declaration of the node, for a bag that does not have it; `missing` says which journals it has."""
    target = options.node_class or _installed(options, missing)
    namespace, _, name = options.node.rpartition("/")
    try:
        trees = asyncio.run(grown(find(target)))
    except Unusable as error:
        raise CommandFailed(str(error)) from error
    if len(trees) == 1 and (isinstance(trees[0], (Child, type))):
        only = trees[0] if isinstance(trees[0], Child) else Child(trees[0])
        return only.replace(name=name, namespace=namespace or only.namespace)
    nodes = [node for tree in trees for node in _nodes(tree)]
    found = next((node for node in nodes if node.name == name), None)
    if found is None:
        near = did_you_mean(name, [node.name for node in nodes])
        raise CommandFailed(f"{target} has no node {name!r}{near}")
    return found


def _installed(options: argparse.Namespace, missing: str) -> str:
    """MODULE:NODE of the one installed executable that is called like the node."""
    name = options.node.rpartition("/")[2]
    found = [entry.value for entry in entry_points(group=GROUP) if entry.name.partition(".")[2] == name]
    if len(set(found)) == 1:
        return found[0]
    remedy = "To play its topics to the node, say which class it is: --module MODULE:NODE"
    raise CommandFailed(f"{missing}. {remedy}{f', one of {chr(44).join(sorted(set(found)))}' if found else ''}")


def _nodes(tree: Any) -> Iterator[Child]:
    if isinstance(tree, Supervisor):
        for child in tree.children:
            yield from _nodes(child)
    elif isinstance(tree, Child):
        yield tree
    elif isinstance(tree, type):
        yield Child(tree)


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


def _tell_topics(verdict: TopicsVerdict, as_json: bool, seconds: float) -> None:
    differences = [*map(str, verdict.differences)]
    if as_json:
        facts = {
            "node": verdict.node, "equal": verdict.equal, "lacking": verdict.lacking, "fed": verdict.fed, "compared": verdict.compared,
            "failure": verdict.failure, "differences": differences, "seconds": round(seconds, 3),
        }  # fmt: skip
        print(json.dumps(facts))
        return
    print("inputs of the node that the bag lacks:", *verdict.lacking, sep="\n  ")
    print("played:", ", ".join(f"{count} of {topic}" for topic, count in verdict.fed.items()) or "nothing")
    for difference in differences:
        print(difference)
    if verdict.failure:
        print(f"the node ended with {verdict.failure}")
    compared = ", ".join(f"{count} of {topic}" for topic, count in verdict.compared.items())
    if not compared and not differences:
        word = "nothing to compare: the bag has no message of a topic on which the node has published"
    elif verdict.equal:
        word = f"no difference in {compared}, stamps left out; what the bag lacks is not compared"
    else:
        word = f"not equal; compared: {compared}, stamps left out"
    print(f"{verdict.node}: {word} ({seconds:.1f} s)")


def _cost(tape: Tape) -> int:
    """Print what a journal holds, and how large it is."""
    from actors.replay.parts import pack

    size, kinds = len(pack(0, tape.entries)), tape.counts()
    for kind, count in sorted(kinds.items(), key=lambda one: -one[1]):
        print(f"{count:>9}  {kind}")
    seconds = tape.seconds
    print(
        f"{sum(kinds.values())} entries, {size} bytes, for {seconds:.1f} s of {tape.node}: {size / max(seconds, 1e-9) / 1e3:.1f} kB/s"
    )
    return 0
