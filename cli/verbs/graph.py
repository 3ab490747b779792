"""`graph`: which node talks with which, as text, for Graphviz or for Mermaid."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actors.runtime.standard import PARAMETER_EVENTS, PARAMETER_SERVICES, ROSOUT, TYPE_DESCRIPTION
from cli.command import CommandFailed, Exit
from cli.parsing import Parser, add_graph_verb
from cli.verb import Verb

if TYPE_CHECKING:
    from actors.typing import Snapshot

STANDARD_TOPICS = frozenset({PARAMETER_EVENTS, ROSOUT})
STANDARD_SERVICES = frozenset({*PARAMETER_SERVICES, TYPE_DESCRIPTION})


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "--format",
        choices=("text", "dot", "mermaid"),
        default="text",
        help="text is the default; `dot -Tsvg` draws dot",
    )
    parser.add_argument("--all", action="store_true", help="also hidden names, and what every node has")
    parser.add_argument("-o", "--output", metavar="FILE", help="write it there")
    add_graph_verb(parser)


async def _draw(options: argparse.Namespace) -> Exit:
    from cli.graph.seen import seen

    async with seen(options) as graph:
        snapshot = _reduced(graph.system.snapshot(), graph.node.fqn, everything=options.all)
    if options.json:
        drawn = f"{snapshot.to_json()}\n"
    elif options.format == "text":
        drawn = "".join(f"{line}\n" for line in _lines(snapshot))
    else:
        drawn = {"dot": snapshot.to_dot, "mermaid": snapshot.to_mermaid}[options.format]()
    _write(drawn, options.output)
    return Exit.DONE


def _write(drawn: str, path: str | None) -> None:
    if path is None:
        sys.stdout.write(drawn)
        return
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.write(drawn)
    except OSError as error:
        raise CommandFailed(f"{path} cannot be written: {error.strerror}") from None


def _reduced(snapshot: Snapshot, own: str, *, everything: bool) -> Snapshot:
    """The snapshot without this command's node; unless all is wanted, without hidden names and what every node has."""
    from msgspec.structs import replace

    from actors.names.names import is_hidden

    def shown(name: str) -> bool:
        return everything or not (
            is_hidden(name) or name in STANDARD_TOPICS or name.rpartition("/")[2] in STANDARD_SERVICES
        )

    def others(edges: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(edge for edge in edges if edge.node != own)

    topics = [
        replace(topic, publishers=others(topic.publishers), subscriptions=others(topic.subscriptions))
        for topic in snapshot.topics
        if shown(topic.name)
    ]
    return replace(
        snapshot,
        nodes=tuple(node for node in snapshot.nodes if node.name != own and shown(node.name)),
        topics=tuple(topic for topic in topics if topic.publishers or topic.subscriptions),
        services=tuple(service for service in snapshot.services if shown(service.name) and service.server != own),
    )


def _lines(snapshot: Snapshot) -> Iterator[str]:
    """Each topic, service and action with its ends, in the direction in which messages and requests go."""
    for title, found in (
        ("Topics", [(each.name, ", ".join(each.types), _nodes(each.publishers), _nodes(each.subscriptions)) for each in snapshot.topics]),
        ("Services", [_service(each) for each in snapshot.services if each.kind == "service"]),
        ("Actions", [_service(each) for each in snapshot.services if each.kind == "action"]),
    ):  # fmt: skip
        if found:
            yield f"{title}:"
        for name, types, begins, ends in found:
            yield f"  {name} [{types}]"
            yield f"    {', '.join(begins) or '(nobody)'} -> {', '.join(ends) or '(nobody)'}"
    busy = {edge.node for topic in snapshot.topics for edge in (*topic.publishers, *topic.subscriptions)}
    busy |= {node for service in snapshot.services for node in (service.server, *service.clients)}
    idle = [node.name for node in snapshot.nodes if node.name not in busy]
    if idle:
        yield "Nodes by themselves:"
        yield from (f"  {name}" for name in idle)


def _nodes(edges: tuple[Any, ...]) -> list[str]:
    return sorted({edge.node for edge in edges})


def _service(each: Any) -> tuple[str, str, list[str], list[str]]:
    return each.name, each.type, list(each.clients), [each.server] if each.server else []


COMMAND = Verb(
    "graph",
    "who talks with whom, as text or picture",
    _arguments,
    _draw,
    description="Who talks with whom: nodes, topics, services and actions.",
)
