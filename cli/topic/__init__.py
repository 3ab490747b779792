"""`topic list | info | echo | pub | hz | bw | delay | type | find`: the topics of the graph, and what is sent on them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import Exit
from cli.parsing import Verb, Verbs, add_common, add_json, add_style, natural, positive, positive_float
from cli.quality import add_qos_options

__all__ = ["main", "verbs"]

TYPE_OPTIONAL = "for instance sensor_msgs/msg/Imu; needed only while nobody publishes"


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("topic", "The topics of the graph.")
    for parser in (
        *_listing(group),
        _echo(group.add("echo", "Output messages from a topic", _load_echo)),
        _pub(group.add("pub", "Publish a message to a topic", _load_pub)),
        *_rates(group),
    ):
        add_json(parser)
        add_common(parser)
    return group


def _listing(group: Verbs) -> tuple[argparse.ArgumentParser, ...]:
    listing = group.add("list", "Output a list of available topics", _load_list)
    listing.add_argument("-t", "--show-types", action="store_true", help="with their types")
    listing.add_argument("-v", "--verbose", action="store_true", help="with their publishers and subscribers")
    info = group.add("info", "Print information about a topic", _load_info)
    info.add_argument("topic_name", help="for instance /imu/data")
    info.add_argument("-v", "--verbose", action="store_true", help="with node, type hash and quality of each endpoint")
    kind = group.add("type", "Print a topic's type", _load_type)
    kind.add_argument("topic_name", help="for instance /imu/data")
    find = group.add("find", "Output a list of available topics of a given type", _load_find)
    find.add_argument("topic_type", help="for instance sensor_msgs/msg/Imu")
    for parser in (listing, find):
        parser.add_argument("-c", "--count-topics", action="store_true", help="only how many")
    for parser in (listing, find, kind):
        parser.add_argument(
            "--include-hidden-topics", action="store_true", help="also those with a part that begins with _"
        )
    return listing, info, kind, find


def _echo(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    parser.add_argument("topic_name", nargs="?", help="for instance /imu/data")
    parser.add_argument("message_type", nargs="?", help=TYPE_OPTIONAL)
    parser.add_argument(
        "--field", action="append", metavar="A.B", help="print only this field, .[0] is an item; may be repeated"
    )
    add_style(parser)
    parser.add_argument("--no-lost-messages", action="store_true", help="do not tell of lost messages")
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
    return parser


def _pub(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
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
    return parser


def _rates(group: Verbs) -> tuple[argparse.ArgumentParser, ...]:
    hz = group.add("hz", "Print the average receiving rate to screen", _load_hz)
    bw = group.add("bw", "Display bandwidth used by topic", _load_bw)
    delay = group.add("delay", "Display delay of topic from timestamp in header", _load_delay)
    for parser, window in ((hz, 10000), (bw, 100)):
        parser.add_argument("topic_name", nargs="*", help="for instance /imu/data; may be repeated")
        parser.add_argument("-a", "--all", action="store_true", dest="all_topics", help="all topics there are")
        parser.add_argument(
            "-w", "--window", type=positive, default=window, metavar="N", help=f"over the last N messages ({window})"
        )
    delay.add_argument("topic_name", help="for instance /imu/data")
    delay.add_argument(
        "-w", "--window", type=positive, default=10000, metavar="N", help="over the last N messages (10000)"
    )
    hz.add_argument("--filter", metavar="EXPRESSION", help="count only messages m for which this is true")
    hz.add_argument("--wall-time", action="store_true", help="the time of day, also with --use-sim-time")
    for parser in (hz, bw, delay):
        add_qos_options(parser, "subscription", "what fits the publishers")
    return hz, bw, delay


def _load_list() -> Verb:
    from cli.topic.listing import list_topics

    return list_topics


def _load_info() -> Verb:
    from cli.topic.listing import info

    return info


def _load_type() -> Verb:
    from cli.topic.listing import type_of

    return type_of


def _load_find() -> Verb:
    from cli.topic.listing import find

    return find


def _load_echo() -> Verb:
    from cli.topic.echo import echo

    return echo


def _load_pub() -> Verb:
    from cli.topic.pub import pub

    return pub


def _load_hz() -> Verb:
    from cli.topic.rate import hz

    return hz


def _load_bw() -> Verb:
    from cli.topic.rate import bw

    return bw


def _load_delay() -> Verb:
    from cli.topic.rate import delay

    return delay
