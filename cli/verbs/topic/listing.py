"""What `topic list | info` print."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, Endpoint, GraphView, absolute, look
from cli.output import print_json
from cli.parsing import count
from cli.verbs.naming import print_names

_WORDS = {PUBLISHER: "PUBLISHER", SUBSCRIPTION: "SUBSCRIPTION", SERVER: "SERVER", CLIENT: "CLIENT"}


async def list_topics(options: argparse.Namespace) -> Exit:
    """The names of the topics, with types or with the number of their ends."""
    async with look(options) as view:
        topics = view.topics(options.hidden)
    if options.verbose and not options.counted:
        _print_verbose(options, view, topics)
    else:
        print_names(topics, options, types=options.show_types)
    return Exit.DONE


def _print_verbose(options: argparse.Namespace, view: GraphView, topics: dict[str, list[str]]) -> None:
    numbers = {name: [len(view.endpoints(kind, name=name)) for kind in (PUBLISHER, SUBSCRIPTION)] for name in topics}
    if options.json:
        print_json(
            [
                {"name": name, "types": types, "publishers": numbers[name][0], "subscribers": numbers[name][1]}
                for name, types in topics.items()
            ]
        )
        return
    for index, (title, noun) in enumerate((("Published", "publisher"), ("Subscribed", "subscriber"))):
        print(f"{title} topics:")
        for name, types in topics.items():
            if number := numbers[name][index]:
                print(f" * {name} [{', '.join(types)}] {count(number, noun)}")
        print()


async def info(options: argparse.Namespace) -> Exit:
    """A topic's types and the number of its ends, or all that is known of each."""
    name = absolute(options.topic_name)
    async with look(options, lambda view: name in view.topics()) as view:
        types = view.topics().get(name)
    if types is None:
        raise CommandFailed(unknown("topic", name, view.topics(hidden=False)))
    ends = {"Publisher": view.endpoints(PUBLISHER, name=name), "Subscription": view.endpoints(SUBSCRIPTION, name=name)}
    if options.json:
        listed = {f"{word.lower()}s": [endpoint_json(end) for end in found] for word, found in ends.items()}
        print_json({"name": name, "types": types, **listed})
        return Exit.DONE
    gap = "\n" if options.verbose else ""
    print(f"Type: {types[0] if len(types) == 1 else types}{gap}")
    for word, found in ends.items():
        print(f"{word} count: {len(found)}{gap}")
        for end in found if options.verbose else ():
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
