"""`daemon start | stop | status`: there is no daemon here, and what asks for one is told so.

A command of `ros2` starts a daemon that remembers the graph. Commands of this one find the graph by themselves within a moment.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import Exit
from cli.output import print_json
from cli.parsing import Verbs, add_json

__all__ = ["main", "verbs"]

NONE = "commands find the graph by themselves; nothing has to run, and nothing has to be stopped"


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("daemon", "There is no daemon: commands find the graph by themselves.")
    start = group.add("start", "Start the daemon if it isn't running: there is none", lambda: _said)
    start.add_argument("-d", "--debug", action="store_true", help="accepted for ros2's sake")
    for parser in (
        start,
        group.add("stop", "Stop the daemon if it is running: there is none", lambda: _said),
        group.add("status", "Output the status of the daemon: there is none", lambda: _said),
    ):
        add_json(parser)
    return group


def _said(options: argparse.Namespace) -> Exit:
    if options.json:
        print_json({"running": False, "needed": False})
    else:
        print(f"The daemon is not running: {NONE}" if options.verb == "status" else f"There is no daemon: {NONE}")
    return Exit.DONE
