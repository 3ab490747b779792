"""`topic list | info | echo | pub | hz | bw | delay | type | find`: the topics of the graph, and what is sent on them."""

from __future__ import annotations

from functools import partial

from cli.parsing import Parser, add_graph_verb, add_style, natural, positive, positive_float
from cli.quality import add_qos_options
from cli.verb import Group, Verb
from cli.verbs.naming import Kind

KIND = Kind("topic", "/imu/data", "sensor_msgs/msg/Imu", lambda view, hidden: view.topics(hidden))
TYPE_OPTIONAL = "for instance sensor_msgs/msg/Imu; needed only while nobody publishes"


def _list(parser: Parser) -> None:
    parser.add_argument("-v", "--verbose", action="store_true", help="with their publishers and subscribers")
    KIND.list_arguments(parser)


def _info(parser: Parser) -> None:
    KIND.add_name(parser)
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="with node, type hash and quality of each endpoint"
    )
    add_graph_verb(parser)


def _echo(parser: Parser) -> None:
    parser.add_argument("topic_name", nargs="?", help="for instance /imu/data")
    parser.add_argument("message_type", nargs="?", help=TYPE_OPTIONAL)
    parser.add_argument(
        "--field", action="append", metavar="A.B", help="print only this field, .[0] is an item; may be repeated"
    )
    add_style(parser)
    parser.add_argument("--no-lost-messages", action="store_true", help="do not report lost messages")
    parser.add_argument("--raw", action="store_true", help="print the bytes as they were sent")
    parser.add_argument(
        "--filter", metavar="EXPRESSION", help="print only messages m for which this Python expression is true"
    )
    parser.add_argument("--once", action="store_true", help="end after one message")
    parser.add_argument(
        "--timeout", type=positive_float, metavar="S", help="end with an error when no message came for S seconds"
    )
    parser.add_argument("-i", "--include-message-info", action="store_true", help="with times and sequence numbers")
    parser.add_argument("-c", "--clear", action="store_true", help="clear the screen before each message")
    parser.add_argument("-n", "--node-name", help="instead of a hidden name")
    add_qos_options(parser, "subscription", "what fits the publishers")
    add_graph_verb(parser)


def _pub(parser: Parser) -> None:
    parser.add_argument("topic_name", help="for instance /cmd_vel")
    parser.add_argument("message_type", help="for instance geometry_msgs/msg/Twist")
    values = parser.add_mutually_exclusive_group()
    values.add_argument(
        "values",
        nargs="?",
        default="{}",
        help="YAML such as '{linear: {x: 0.5}}'; `now` in a time and `auto` in a header are the instant of sending",
    )
    values.add_argument("--stdin", action="store_true", help="read the values from the standard input")
    values.add_argument("--yaml-file", metavar="FILE", help="publish the messages of a file, as topic echo writes it")
    parser.add_argument("-r", "--rate", type=positive_float, default=1.0, metavar="HZ", help="messages a second (1)")
    parser.add_argument("-p", "--print", type=natural, default=1, metavar="N", help="print every N-th message (1)")
    number = parser.add_mutually_exclusive_group()
    number.add_argument("-1", "--once", action="store_true", help="publish one message and end")
    number.add_argument("-t", "--times", type=natural, default=0, metavar="N", help="publish N messages and end")
    parser.add_argument(
        "-w",
        "--wait-matching-subscriptions",
        type=natural,
        metavar="N",
        help="wait for N subscriptions (1 with --once or --times, else 0)",
    )
    parser.add_argument(
        "--max-wait-time-secs", type=positive_float, metavar="S", help="wait for them at most S seconds"
    )
    parser.add_argument(
        "--keep-alive",
        type=positive_float,
        default=0.1,
        metavar="S",
        help="stay S seconds after the last message (0.1)",
    )
    parser.add_argument("-n", "--node-name", help="instead of a hidden name")
    add_qos_options(parser, "publisher", "default")
    add_graph_verb(parser)


def _rate(parser: Parser, window: int) -> None:
    parser.add_argument("topic_name", nargs="*", help="for instance /imu/data; may be repeated")
    parser.add_argument("-a", "--all", action="store_true", dest="all_topics", help="all topics there are")
    _window(parser, window)


def _window(parser: Parser, window: int) -> None:
    parser.add_argument(
        "-w", "--window", type=positive, default=window, metavar="N", help=f"over the last N messages ({window})"
    )
    add_qos_options(parser, "subscription", "what fits the publishers")
    add_graph_verb(parser)


def _hz(parser: Parser) -> None:
    parser.add_argument("--filter", metavar="EXPRESSION", help="count only messages m for which this is true")
    parser.add_argument("--wall-time", action="store_true", help="the time of day, also with --use-sim-time")
    _rate(parser, 10000)


def _delay(parser: Parser) -> None:
    KIND.add_name(parser)
    _window(parser, 10000)


COMMAND = Group(
    "topic",
    "The topics of the graph.",
    Verb("list", "Output a list of available topics", _list, "cli.verbs.topic.listing:list_topics"),
    Verb("info", "Print information about a topic", _info, "cli.verbs.topic.listing:info"),
    Verb("type", "Print a topic's type", KIND.type_arguments, "cli.verbs.naming:type_of"),
    Verb("find", "Output a list of available topics of a given type", KIND.find_arguments, "cli.verbs.naming:find"),
    Verb("echo", "Output messages from a topic", _echo, "cli.verbs.topic.echo:echo"),
    Verb("pub", "Publish a message to a topic", _pub, "cli.verbs.topic.pub:pub"),
    Verb("hz", "Print the average receiving rate to screen", _hz, "cli.verbs.topic.rate:hz"),
    Verb("bw", "Display bandwidth used by topic", partial(_rate, window=100), "cli.verbs.topic.rate:bw"),
    Verb("delay", "Display delay of topic from timestamp in header", _delay, "cli.verbs.topic.rate:delay"),
)
