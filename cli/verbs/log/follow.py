"""Log lines of the nodes, as they come, with filters."""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import sys
from collections.abc import Callable
from typing import Final

from actors import Topic, qos
from actors.interfaces.rcl_interfaces.msg import Log
from actors.logs.terminal import shown
from cli.command import CommandFailed, Exit
from cli.graph.seen import seen
from cli.output import control, print_json
from cli.verbs.log import LEVELS

_COLOURS: Final = {10: "\x1b[32m", 30: "\x1b[33m", 40: "\x1b[31m", 50: "\x1b[31m"}


def _chosen(options: argparse.Namespace) -> Callable[[Log], bool]:
    """Which lines are wanted."""
    try:
        match = re.compile(options.match or "")
        exclude = None if options.exclude is None else re.compile(options.exclude)
    except re.error as error:
        raise CommandFailed(f"{error.pattern!r} is no regular expression: {error}") from None
    least = next(number for number, word in LEVELS.items() if word == options.level.upper())
    nodes = [name.strip("/").replace("/", ".") + ("." if name.endswith("/") else "") for name in options.node]

    def wanted(line: Log) -> bool:
        of_node = not nodes or any(_is_of(line.name, node) for node in nodes)
        return (
            line.level >= least
            and of_node
            and match.search(line.msg) is not None
            and (exclude is None or exclude.search(line.msg) is None)
        )

    return wanted


def _is_of(logger: str, node: str) -> bool:
    """Whether a logger is that of a node, one below it, or one in the namespace that ends with a dot."""
    return logger.startswith(node) if node.endswith(".") else logger == node or logger.startswith(f"{node}.")


async def follow(options: argparse.Namespace) -> Exit:
    """Print log lines until Ctrl-C, those of the last ten seconds first."""
    wanted = _chosen(options)
    async with seen(options) as graph, graph.node.subscribe(Topic(Log, "/rosout", qos.ROSOUT)) as lines:
        try:
            async with asyncio.timeout(options.spin_time if options.past else None):
                async for line in lines:
                    if wanted(line):
                        _print(line, options)
        except TimeoutError:  # nodes that log all the time must not keep it from ending
            pass
    return Exit.DONE


def _print(line: Log, options: argparse.Namespace) -> None:
    word = LEVELS.get(line.level, str(line.level))
    seconds = f"{line.stamp.sec}.{line.stamp.nanosec:09d}"
    if options.json:
        place = {"file": line.file, "function": line.function, "line": line.line}
        print_json({"level": word, "stamp": float(seconds), "name": line.name, "message": line.msg, **place})
        return
    text = f"[{word}] [{seconds}] [{line.name}]: {shown(line.msg, '    ')}"
    colour = _COLOURS.get(line.level, "") if sys.stdout.isatty() and not os.environ.get("NO_COLOR") else ""
    control(colour)
    print(text, end="" if colour else "\n")
    control("\x1b[0m\n" if colour else "")
