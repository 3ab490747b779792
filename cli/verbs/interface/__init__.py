"""`interface list | show | package | packages | proto | generate`: the types of messages, services and actions that are known here."""

from __future__ import annotations

from cli.parsing import Parser, add_common, add_interfaces, add_json
from cli.verb import Group, Verb


def _list(parser: Parser) -> None:
    parser.add_argument("-m", "--only-msgs", action="store_true", help="only messages")
    parser.add_argument("-s", "--only-srvs", action="store_true", help="only services")
    parser.add_argument("-a", "--only-actions", action="store_true", help="only actions")
    _common(parser)


def _package(parser: Parser) -> None:
    parser.add_argument("package_name", help="for instance geometry_msgs")
    _list(parser)


def _show(parser: Parser) -> None:
    parser.add_argument("type", help="for instance sensor_msgs/msg/Imu; - reads it from the standard input")
    comments = parser.add_mutually_exclusive_group()
    comments.add_argument("--all-comments", action="store_true", help="also those of nested types")
    comments.add_argument("--no-comments", action="store_true", help="no comments and no empty lines")
    _common(parser)


def _proto(parser: Parser) -> None:
    parser.add_argument("type", help="for instance sensor_msgs/msg/Imu")
    parser.add_argument("--no-quotes", action="store_true", help="without quotes around it")
    _common(parser)


def _common(parser: Parser) -> None:
    add_json(parser)
    add_interfaces(parser)


def _generate(parser: Parser) -> None:
    parser.add_argument("source", nargs="+", help="a folder of definitions; with --definitions types or packages")
    parser.add_argument(
        "--definitions",
        action="store_true",
        help="write DIR/PACKAGE/msg/NAME.msg, and so on, of types that are known here or to the nodes of the graph",
    )
    parser.add_argument("--out", metavar="DIR", help="where (beside the folder; for definitions: share)")
    parser.add_argument("--home", help="the Python package that DIR is, '' for none (by where it lies)")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if a module is missing or old")
    add_common(parser)


COMMAND = Group(
    "interface",
    "The types of messages, services and actions.",
    Verb("list", "List all interface types available", _list, "cli.verbs.interface.show:list_types"),
    Verb(
        "packages",
        "Output a list of packages that provide interfaces",
        _list,
        "cli.verbs.interface.show:packages",
    ),
    Verb(
        "package",
        "Output a list of available interface types within one package",
        _package,
        "cli.verbs.interface.show:package",
    ),
    Verb("show", "Output the interface definition", _show, "cli.verbs.interface.show:show"),
    Verb("proto", "Output an interface prototype", _proto, "cli.verbs.interface.show:proto"),
    Verb("generate", "Write typed Python modules, or definitions", _generate, "cli.verbs.interface.generate:generate"),
)
