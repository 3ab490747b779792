"""What is known of the ends of a topic or a service: `info`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping

from actors.suggest import did_you_mean
from actors.transport.format.tokens import EndpointKind
from cli.command import CommandFailed, Exit
from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, Endpoint, absolute, look
from cli.output import print_json
from cli.verbs.naming import Kind

_WORDS = {PUBLISHER: "PUBLISHER", SUBSCRIPTION: "SUBSCRIPTION", SERVER: "SERVER", CLIENT: "CLIENT"}


async def show(options: argparse.Namespace, kind: Kind, ends: Mapping[str, EndpointKind], *, gap: str = "") -> Exit:
    """The types of one topic or service and how many ends it has, or all that is known of each. `gap` stands behind each heading."""
    name = absolute(getattr(options, f"{kind.word}_name"))
    async with look(options, lambda view: name in kind.found(view, True)) as view:
        types = kind.found(view, True).get(name)
    if types is None:
        raise CommandFailed(unknown(kind.word, name, kind.found(view, False)))
    found = {word: view.endpoints(end, name=name) for word, end in ends.items()}
    if options.json:
        listed = {
            f"{word.lower().removesuffix('s')}s": [endpoint_json(end) for end in each] for word, each in found.items()
        }
        print_json({"name": name, "types": types, **listed})
        return Exit.DONE
    print(f"Type: {types[0] if len(types) == 1 else types}{gap}")
    for word, each in found.items():
        print(f"{word} count: {len(each)}{gap}")
        for end in each if options.verbose else ():
            print("\n".join(endpoint_lines(end)) + "\n")
    return Exit.DONE


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """The text about a name that nobody uses, with the one that was probably meant."""
    return f"Unknown {what} '{name}'{did_you_mean(name, list(known))}"


def endpoint_lines(end: Endpoint) -> Iterator[str]:
    """All that is known of one endpoint."""
    kind = "Service" if end.about.kind in (SERVER, CLIENT) else "Topic"
    namespace, _, name = end.node.rpartition("/")
    yield f"Node name: {name}"
    yield f"Node namespace: {namespace or '/'}"
    yield f"{kind} type: {end.about.type}"
    yield f"{kind} type hash: {end.about.type_hash}"
    yield f"Endpoint type: {_WORDS[end.about.kind]}"
    if kind == "Service":
        yield "Endpoint count: 1"
    yield f"GID: {'.'.join(f'{byte:02x}' for byte in end.about.gid)}"
    yield "QoS profile:"
    for title, value in _quality(end).items():
        yield f"  {title}: {value}"


def _quality(end: Endpoint) -> dict[str, str]:
    offered = end.about.qos
    history = offered.history.name + (f" ({offered.depth})" if offered.history.name == "KEEP_LAST" else "")
    return {
        "Reliability": offered.reliability.name,
        "History (Depth)": history,
        "Durability": offered.durability.name,
        "Lifespan": _duration(offered.lifespan),
        "Deadline": _duration(offered.deadline),
        "Liveliness": offered.liveliness.name,
        "Liveliness lease duration": _duration(offered.liveliness_lease),
    }


def _duration(seconds: float | None) -> str:
    return "Infinite" if seconds is None else f"{round(seconds * 1e9)} nanoseconds"


def endpoint_json(end: Endpoint) -> dict[str, object]:
    """The same as `endpoint_lines`, as data."""
    offered = end.about.qos
    return {
        "node": end.node,
        "type": end.about.type,
        "type_hash": end.about.type_hash,
        "gid": end.about.gid.hex(),
        "qos": {
            "reliability": offered.reliability.value,
            "history": offered.history.value,
            "depth": offered.depth,
            "durability": offered.durability.value,
            "lifespan": offered.lifespan,
            "deadline": offered.deadline,
            "liveliness": offered.liveliness.value,
            "liveliness_lease": offered.liveliness_lease,
        },
    }
