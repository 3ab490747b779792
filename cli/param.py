"""`param list | get | set | describe | delete | dump | load`: the parameters of the nodes."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import Exit
from cli.parsing import Verb, Verbs, add_common, add_json, positive_float

__all__ = ["main", "verbs"]


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("param", "The parameters of the nodes.")
    listing = group.add("list", "Output a list of available parameters", lambda: _verb("list_parameters"))
    listing.add_argument("node_name", nargs="?", help="of this node, for instance /battery; without it, of all nodes")
    listing.add_argument("--filter", metavar="REGEX", help="only those whose names begin with this regular expression")
    listing.add_argument("--param-prefixes", nargs="+", default=[], metavar="P", help="only those below these names")
    listing.add_argument("--param-type", action="store_true", help="with their types")
    get = group.add("get", "Get parameter", lambda: _verb("get"))
    get.add_argument(
        "node_name", help="for instance /battery; alone, it is the name of a parameter to ask all nodes for"
    )
    get.add_argument("parameter_name", nargs="*", help="one or more")
    get.add_argument("--hide-type", action="store_true", help="only the value")
    put = group.add("set", "Set parameter", lambda: _verb("put"))
    put.add_argument("node_name", help="for instance /battery")
    put.add_argument(
        "params_and_values", nargs="+", metavar="NAME VALUE", help="the value in YAML, such as 1.5 or '[1, 2]'"
    )
    put.add_argument("--atomic", action="store_true", help="all of them, or none")
    describe = group.add(
        "describe", "Show descriptive information about declared parameters", lambda: _verb("describe")
    )
    describe.add_argument("node_name", help="for instance /battery")
    describe.add_argument("parameter_names", nargs="+", help="one or more")
    delete = group.add("delete", "Delete parameter", lambda: _verb("delete"))
    delete.add_argument("node_name", help="for instance /battery")
    delete.add_argument("parameter_name", help="the one to delete")
    dump = group.add("dump", "Show all of the parameters of a node in a YAML file format", lambda: _verb("dump"))
    dump.add_argument("node_name", help="for instance /battery")
    load = group.add("load", "Load parameter file for a node", lambda: _verb("load"))
    load.add_argument("node_name", help="for instance /battery")
    load.add_argument("parameter_file", help="as param dump writes it")
    load.add_argument("--no-use-wildcard", action="store_true", help="leave out what the file says of all nodes, /**")
    for parser in (listing, get, put, describe, delete, dump, load):
        _common(parser, listing=parser is listing)
    return group


def _common(parser: argparse.ArgumentParser, *, listing: bool) -> None:
    parser.add_argument("--include-hidden-nodes", action="store_true", help="also nodes whose names begin with _")
    if not listing:
        parser.add_argument("--timeout", type=float, default=1.0, metavar="S", help="wait S seconds for the node (1)")
    parser.add_argument(
        "--service-timeout", type=positive_float, default=5.0, metavar="S", help="wait S seconds for an answer (5)"
    )
    add_json(parser)
    add_common(parser)


def _verb(name: str) -> Verb:
    from cli import param_verbs

    verb: Verb = getattr(param_verbs, name)
    return verb
