"""`param list | get | set | describe | delete | dump | load`: the parameters of the nodes."""

from __future__ import annotations

from cli.parsing import Parser, add_graph_verb, nonnegative_float, positive_float
from cli.verb import Group, Verb


def _list(parser: Parser) -> None:
    parser.add_argument("node_name", nargs="?", help="of this node, for instance /battery; without it, of all nodes")
    parser.add_argument("--filter", metavar="REGEX", help="only those whose names begin with this regular expression")
    parser.add_argument("--param-prefixes", nargs="+", default=[], metavar="P", help="only those below these names")
    parser.add_argument("--param-type", action="store_true", help="with their types")
    _asking(parser)


def _get(parser: Parser) -> None:
    parser.add_argument(
        "node_name", help="for instance /battery; alone, it is the name of a parameter to ask all nodes for"
    )
    parser.add_argument("parameter_name", nargs="*", help="one or more")
    parser.add_argument("--hide-type", action="store_true", help="only the value")
    _waiting(parser)


def _set(parser: Parser) -> None:
    _node(parser)
    parser.add_argument(
        "params_and_values", nargs="+", metavar="NAME VALUE", help="the value in YAML, such as 1.5 or '[1, 2]'"
    )
    parser.add_argument("--atomic", action="store_true", help="all of them, or none")
    _waiting(parser)


def _describe(parser: Parser) -> None:
    _node(parser)
    parser.add_argument("parameter_names", nargs="+", help="one or more")
    _waiting(parser)


def _delete(parser: Parser) -> None:
    _node(parser)
    parser.add_argument("parameter_name", help="the one to delete")
    _waiting(parser)


def _dump(parser: Parser) -> None:
    _node(parser)
    _waiting(parser)


def _load(parser: Parser) -> None:
    _node(parser)
    parser.add_argument("parameter_file", help="as param dump writes it")
    parser.add_argument("--no-use-wildcard", action="store_true", help="leave out what the file says of all nodes, /**")
    _waiting(parser)


def _node(parser: Parser) -> None:
    parser.add_argument("node_name", help="for instance /battery")


def _waiting(parser: Parser) -> None:
    parser.add_argument(
        "--timeout", type=nonnegative_float, default=1.0, metavar="S", help="wait S seconds for the node (1)"
    )
    _asking(parser)


def _asking(parser: Parser) -> None:
    parser.add_argument("--include-hidden-nodes", action="store_true", help="also nodes whose names begin with _")
    parser.add_argument(
        "--service-timeout", type=positive_float, default=5.0, metavar="S", help="wait S seconds for an answer (5)"
    )
    add_graph_verb(parser)


COMMAND = Group(
    "param",
    "The parameters of the nodes.",
    Verb("list", "Output a list of available parameters", _list, "cli.verbs.param.verbs:list_parameters"),
    Verb("get", "Get parameter", _get, "cli.verbs.param.verbs:get"),
    Verb("set", "Set parameter", _set, "cli.verbs.param.verbs:put"),
    Verb(
        "describe",
        "Show descriptive information about declared parameters",
        _describe,
        "cli.verbs.param.verbs:describe",
    ),
    Verb("delete", "Delete parameter", _delete, "cli.verbs.param.verbs:delete"),
    Verb("dump", "Show all of the parameters of a node in a YAML file format", _dump, "cli.verbs.param.verbs:dump"),
    Verb("load", "Load parameter file for a node", _load, "cli.verbs.param.verbs:load"),
)
