"""`node list | info`: the nodes of the graph."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Verbs, add_common, add_json, complain

if TYPE_CHECKING:
    from cli.view import GraphView

__all__ = ["main", "verbs"]


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("node", "The nodes of the graph.")
    listing = group.add("list", "Output a list of available nodes", lambda: _list)
    listing.add_argument("-a", "--all", action="store_true", help="also hidden ones, whose names begin with _")
    listing.add_argument("-c", "--count-nodes", action="store_true", help="only how many")
    info = group.add("info", "Output information about a node", lambda: _info)
    info.add_argument("node_name", help="its full name, for instance /battery")
    info.add_argument("--include-hidden", action="store_true", help="also hidden topics, services and actions")
    for parser in (listing, info):
        add_json(parser)
        add_common(parser)
    return group


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


async def _list(options: argparse.Namespace) -> Exit:
    from cli.view import look

    async with look(options) as view:
        names = view.nodes(hidden=options.all)
    if options.count_nodes:
        print(len(names))
        return Exit.DONE
    if options.json:
        print_json(names)
    else:
        for name in names:
            print(name)
    if len(set(names)) < len(names):
        complain("WARNING: some nodes of the graph share a name: what one is told, may reach the other")
    return Exit.DONE


async def _info(options: argparse.Namespace) -> Exit:
    from cli.view import absolute, look

    name = absolute(options.node_name)
    async with look(options, lambda view: name in view.nodes()) as view:
        same = view.nodes().count(name)
        if not same:
            from actors.suggest import did_you_mean

            hint = did_you_mean(name, view.nodes(hidden=False))
            raise CommandFailed(f"Unable to find node '{options.node_name}'{hint}")
        sections = _sections(view, name, options.include_hidden)
    if same > 1:
        complain(f"WARNING: {same} nodes of the graph share the name {name}: this is about all of them")
    if options.json:
        print_json({"node": name, **sections})
        return Exit.DONE
    print(name)
    for title, found in sections.items():
        print(f"  {title}:")
        print("\n".join(f"    {each}: {', '.join(types)}" for each, types in found.items()))
    return Exit.DONE


def _sections(view: GraphView, node: str, hidden: bool) -> dict[str, dict[str, list[str]]]:
    from cli.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION

    return {
        "Subscribers": view.of_node(node, SUBSCRIPTION, hidden),
        "Publishers": view.of_node(node, PUBLISHER, hidden),
        "Service Servers": view.of_node(node, SERVER, hidden),
        "Service Clients": view.of_node(node, CLIENT, hidden),
        "Action Servers": view.actions_of_node(node, PUBLISHER),
        "Action Clients": view.actions_of_node(node, SUBSCRIPTION),
    }
