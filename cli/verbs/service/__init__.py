"""`service list | type | find | info | call | echo`: the services of the graph."""

from __future__ import annotations

from cli.parsing import Parser, add_graph_verb, add_style, positive_float
from cli.quality import add_qos_options
from cli.verb import Group, Verb

EXAMPLE = "for instance /get_battery_status"
TYPE_EXAMPLE = "for instance std_srvs/srv/SetBool"


def _list(parser: Parser) -> None:
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count-services", action="store_true", help="only how many")
    _hidden(parser)


def _type(parser: Parser) -> None:
    parser.add_argument("service_name", help=EXAMPLE)
    _hidden(parser)


def _find(parser: Parser) -> None:
    parser.add_argument("service_type", help=TYPE_EXAMPLE)
    parser.add_argument("-c", "--count-services", action="store_true", help="only how many")
    _hidden(parser)


def _hidden(parser: Parser) -> None:
    parser.add_argument(
        "--include-hidden-services", action="store_true", help="also those with a part that begins with _"
    )
    add_graph_verb(parser)


def _info(parser: Parser) -> None:
    parser.add_argument("service_name", help=EXAMPLE)
    parser.add_argument("-v", "--verbose", action="store_true", help="with node, type hash and quality of each end")
    add_graph_verb(parser)


def _call(parser: Parser) -> None:
    parser.add_argument("service_name", help=EXAMPLE)
    parser.add_argument("service_type", help=TYPE_EXAMPLE)
    values = parser.add_mutually_exclusive_group()
    values.add_argument("values", nargs="?", default="{}", help="the request in YAML, such as '{data: true}'")
    values.add_argument("--stdin", action="store_true", help="read the request from the standard input")
    parser.add_argument(
        "-r", "--rate", type=positive_float, metavar="HZ", help="call again and again, so often a second"
    )
    parser.add_argument(
        "--timeout", type=positive_float, metavar="S", help="wait at most S seconds for the service, and for an answer"
    )
    add_qos_options(parser, "client", "services_default")
    add_graph_verb(parser)


def _echo(parser: Parser) -> None:
    parser.add_argument("service_name", help=EXAMPLE)
    parser.add_argument("service_type", nargs="?", help=TYPE_EXAMPLE)
    add_style(parser)
    add_qos_options(parser, "subscription", "services_default")
    add_graph_verb(parser)


COMMAND = Group(
    "service",
    "The services of the graph.",
    Verb("list", "Output a list of available services", _list, "cli.verbs.service.listing:list_services"),
    Verb("type", "Output a service's type", _type, "cli.verbs.service.listing:type_of"),
    Verb("find", "Output a list of available services of a given type", _find, "cli.verbs.service.listing:find"),
    Verb("info", "Print information about a service", _info, "cli.verbs.service.listing:info"),
    Verb("call", "Call a service", _call, "cli.verbs.service.call:call"),
    Verb("echo", "Echo a service", _echo, "cli.verbs.service.echo:echo"),
)
