"""`daemon start | stop | status`: there is no daemon here, and these say so.

A command of `ros2` starts a daemon that remembers the graph. Commands of this one find the graph by themselves within a moment.
"""

from __future__ import annotations

import argparse

from cli.command import Exit
from cli.output import print_json
from cli.parsing import Parser, add_json
from cli.verb import Group, Verb

NONE = "commands find the graph by themselves; nothing has to run, and nothing has to be stopped"


def _start_arguments(parser: Parser) -> None:
    parser.add_argument("-d", "--debug", action="store_true", help="accepted for ros2's sake")
    add_json(parser)


def _none(options: argparse.Namespace) -> Exit:
    return _print(options, "There is no daemon")


def _status(options: argparse.Namespace) -> Exit:
    return _print(options, "The daemon is not running")


def _print(options: argparse.Namespace, text: str) -> Exit:
    if options.json:
        print_json({"running": False, "needed": False})
    else:
        print(f"{text}: {NONE}")
    return Exit.DONE


COMMAND = Group(
    "daemon",
    "There is no daemon: commands find the graph by themselves.",
    Verb("start", "Start the daemon if it isn't running: there is none", _start_arguments, _none),
    Verb("stop", "Stop the daemon if it is running: there is none", add_json, _none),
    Verb("status", "Output the status of the daemon: there is none", add_json, _status),
)
