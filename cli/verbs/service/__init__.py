"""`service list | type | find | info | call | echo`: the services of the graph."""

from __future__ import annotations

from cli.parsing import Parser, add_graph_verb, add_style, positive_float
from cli.quality import add_qos_options
from cli.verb import Group, Verb
from cli.verbs.naming import Kind

TYPE_EXAMPLE = "for instance std_srvs/srv/SetBool"
KIND = Kind("service", "/get_battery_status", "std_srvs/srv/SetBool", lambda view, hidden: view.services(hidden))


def _info(parser: Parser) -> None:
    KIND.add_name(parser)
    parser.add_argument("-v", "--verbose", action="store_true", help="with node, type hash and quality of each end")
    add_graph_verb(parser)


def _call(parser: Parser) -> None:
    KIND.add_name(parser)
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
    KIND.add_name(parser)
    parser.add_argument("service_type", nargs="?", help=TYPE_EXAMPLE)
    add_style(parser)
    add_qos_options(parser, "subscription", "services_default")
    add_graph_verb(parser)


COMMAND = Group(
    "service",
    "The services of the graph.",
    Verb("list", "Output a list of available services", KIND.list_arguments, "cli.verbs.naming:list_names"),
    Verb("type", "Output a service's type", KIND.type_arguments, "cli.verbs.naming:type_of"),
    Verb("find", "Output a list of available services of a given type", KIND.find_arguments, "cli.verbs.naming:find"),
    Verb("info", "Print information about a service", _info, "cli.verbs.service.info:info"),
    Verb("call", "Call a service", _call, "cli.verbs.service.call:call"),
    Verb("echo", "Echo a service", _echo, "cli.verbs.service.echo:echo"),
)
