"""`log`: what the nodes log, as it comes, with filters; and from which level on they do."""

from __future__ import annotations

import argparse
from typing import Final

from cli.command import Exit
from cli.parsing import Parser, add_graph_verb
from cli.verb import Verb

LEVELS: Final = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
WORDS: Final = tuple(word.lower() for word in LEVELS.values())


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "--level", choices=WORDS, default="debug", metavar="LEVEL", help=f"{', '.join(WORDS)}: that one and above"
    )
    parser.add_argument(
        "--node", action="append", default=[], metavar="NAME", help="only of this node, or of all in a namespace /NAME/"
    )
    parser.add_argument("--match", metavar="REGEX", help="only lines in which this regular expression is found")
    parser.add_argument("--exclude", metavar="REGEX", help="no lines in which this is found")
    parser.add_argument("--past", action="store_true", help="only those of the last ten seconds, then end")
    levels = parser.add_argument_group("levels at run time").add_mutually_exclusive_group()
    levels.add_argument("--levels", action="store_true", help="print from which level on the nodes log, then end")
    levels.add_argument(
        "--set",
        action="append",
        metavar="[LOGGER:=]LEVEL",
        help="let nodes log from this level on, then end; unset takes it back. Both need nodes with the parameter enable_logger_service",
    )
    add_graph_verb(parser)


async def _run(options: argparse.Namespace) -> Exit:
    from cli.verbs.log.follow import follow
    from cli.verbs.log.levels import set_levels, show

    if options.levels:
        return await show(options)
    return await (set_levels(options) if options.set else follow(options))


COMMAND = Verb(
    "log",
    "what the nodes log",
    _arguments,
    _run,
    description="What the nodes log: that of the last ten seconds, and what comes.",
)
