"""`node list | info`: the nodes of the graph."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_graph_verb, complain
from cli.verb import Group, Verb

if TYPE_CHECKING:
    from cli.graph.view import GraphView


def _list_arguments(parser: Parser) -> None:
    parser.add_argument("-a", "--all", action="store_true", help="also hidden ones, whose names begin with _")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="only how many")
    add_graph_verb(parser)


def _info_arguments(parser: Parser) -> None:
    parser.add_argument("node_name", help="its full name, for instance /battery")
    parser.add_argument("--include-hidden", action="store_true", help="also hidden topics, services and actions")
    add_graph_verb(parser)


async def _list(options: argparse.Namespace) -> Exit:
    from cli.graph.view import look

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
        complain("WARNING: some nodes of the graph share a name: a message or request for one may reach another")
    return Exit.DONE


async def _info(options: argparse.Namespace) -> Exit:
    from cli.graph.view import absolute, look

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
    from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION

    return {
        "Subscribers": view.of_node(node, SUBSCRIPTION, hidden),
        "Publishers": view.of_node(node, PUBLISHER, hidden),
        "Service Servers": view.of_node(node, SERVER, hidden),
        "Service Clients": view.of_node(node, CLIENT, hidden),
        "Action Servers": view.actions_of_node(node, PUBLISHER),
        "Action Clients": view.actions_of_node(node, SUBSCRIPTION),
    }


COMMAND = Group(
    "node",
    "The nodes of the graph.",
    Verb("list", "Output a list of available nodes", _list_arguments, _list),
    Verb("info", "Output information about a node", _info_arguments, _info),
)
