"""`topic list | echo`: the topics of the graph, and what is sent on them."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Sequence

from cli.graph import add_graph_options
from cli.text import TRUNCATED

__all__ = ["main"]


def main(argv: Sequence[str]) -> int:
    """Run one verb of the group; the exit code."""
    options = _parser().parse_args(argv)
    if options.verb == "list":
        from cli.topic_list import list_topics

        return asyncio.run(list_topics(options))
    from cli.topic_echo import echo

    return asyncio.run(echo(options))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m robot topic", description="The topics of the graph.")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    listing = verbs.add_parser("list", help="their names, one a line")
    listing.add_argument("-t", "--show-types", action="store_true", help="with their types")
    listing.add_argument("-c", "--count-topics", action="store_true", help="only how many")
    listing.add_argument("-v", "--verbose", action="store_true", help="with their publishers and subscribers")
    listing.add_argument(
        "--include-hidden-topics", action="store_true", help="also those with a part that begins with _"
    )
    add_graph_options(listing)
    echo = verbs.add_parser("echo", help="print what is sent on a topic, as YAML")
    echo.add_argument("topic", help="for instance /imu/data")
    echo.add_argument("type", nargs="?", help="for instance sensor_msgs/msg/Imu; needed only while nobody publishes")
    echo.add_argument("--once", action="store_true", help="end after one message")
    echo.add_argument("--field", metavar="A.B", help="print only this field")
    echo.add_argument("-f", "--full-length", action="store_true", help="print long arrays and texts whole")
    echo.add_argument(
        "-l",
        "--truncate-length",
        type=_positive,
        default=TRUNCATED,
        metavar="N",
        help=f"cut them after N ({TRUNCATED})",
    )
    echo.add_argument("--flow-style", action="store_true", help="each message on one line")
    echo.add_argument("--timeout", type=float, metavar="S", help="end with an error when no message came for S seconds")
    echo.add_argument(
        "--qos-reliability", choices=("reliable", "best_effort"), help="instead of what fits the publishers"
    )
    echo.add_argument("--qos-durability", choices=("transient_local", "volatile"), help="likewise")
    echo.add_argument("--qos-depth", type=_positive, metavar="N", help="likewise")
    add_graph_options(echo)
    return parser


def _positive(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number above 0")
    return number
