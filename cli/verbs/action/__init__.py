"""`action list | info | type | find | send_goal | echo`: the actions of the graph."""

from __future__ import annotations

from cli.parsing import Parser, add_graph_verb, add_style, natural
from cli.quality import add_qos_options
from cli.verb import Group, Verb
from cli.verbs.naming import Kind

KIND = Kind(
    "action",
    "/move_to_position",
    "example_interfaces/action/Fibonacci",
    lambda view, hidden: view.actions(),
    hides=False,
)


def _info(parser: Parser) -> None:
    KIND.add_name(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count", action="store_true", help="only how many clients and servers")
    add_graph_verb(parser)


def _send_goal(parser: Parser) -> None:
    KIND.add_name(parser)
    parser.add_argument("action_type", help="for instance example_interfaces/action/Fibonacci")
    values = parser.add_mutually_exclusive_group()
    values.add_argument("goal", nargs="?", default="{}", help="the goal in YAML, such as '{order: 5}'")
    values.add_argument("--stdin", action="store_true", help="read the goal from the standard input")
    parser.add_argument("-f", "--feedback", action="store_true", help="print feedback")
    parser.add_argument(
        "-t",
        "--timeout",
        type=natural,
        metavar="S",
        help="wait at most S seconds for each of server, answer and result",
    )
    add_graph_verb(parser)


def _echo(parser: Parser) -> None:
    KIND.add_name(parser)
    parser.add_argument("action_type", nargs="?", help="for instance example_interfaces/action/Fibonacci")
    parser.add_argument(
        "-i",
        action="append",
        dest="interfaces",
        default=[],
        metavar="NAMES",
        help="only these, separated by |: GOAL_SERVICE, CANCEL_SERVICE, RESULT_SERVICE, FEEDBACK_TOPIC, STATUS_TOPIC; also as --interfaces",
    )
    add_style(parser)
    add_qos_options(parser, "subscription to events", "services_default")
    add_graph_verb(parser)


COMMAND = Group(
    "action",
    "The actions of the graph.",
    Verb("list", "Output a list of action names", KIND.list_arguments, "cli.verbs.naming:list_names"),
    Verb("info", "Print information about an action", _info, "cli.verbs.action.info:info"),
    Verb("type", "Print a action's type", KIND.type_arguments, "cli.verbs.naming:type_of"),
    Verb("find", "Find actions from type", KIND.find_arguments, "cli.verbs.naming:find"),
    Verb("send_goal", "Send an action goal", _send_goal, "cli.verbs.action.send_goal:send_goal"),
    Verb("echo", "Echo a action", _echo, "cli.verbs.action.echo:echo"),
)
