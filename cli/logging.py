"""`log`: what the nodes log, as it comes, with filters; and from which level on they do."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, Final

from cli.command import CommandFailed, Exit
from cli.parsing import add_common, add_json

if TYPE_CHECKING:
    from actors.interfaces.rcl_interfaces.msg import Log

__all__ = ["main"]

LEVELS: Final = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
WORDS: Final = tuple(word.lower() for word in LEVELS.values())
_COLOURS: Final = {10: "\x1b[32m", 30: "\x1b[33m", 40: "\x1b[31m", 50: "\x1b[31m"}


def main(argv: Sequence[str]) -> int | Exit:
    """Print log lines until Ctrl-C, those of the last ten seconds first."""
    parser = argparse.ArgumentParser(
        prog="python -m robot log",
        usage="python -m robot log [options]",
        description="What the nodes log: that of the last ten seconds, and what comes.",
    )
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
    add_json(parser)
    add_common(parser)
    options = parser.parse_args(list(argv))
    import asyncio

    from cli.parsing import until_signal

    return asyncio.run(until_signal(_verb(options)))


def _verb(options: argparse.Namespace) -> Coroutine[Any, Any, Exit]:
    if options.levels or options.set:
        from cli.log_levels import set_levels, show

        return show(options) if options.levels else set_levels(options)
    return _follow(options, _chosen(options))


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


async def _follow(options: argparse.Namespace, wanted: Callable[[Log], bool]) -> Exit:
    import asyncio

    from actors import Topic, qos
    from actors.interfaces.rcl_interfaces.msg import Log
    from cli.graph import seen

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
    import os
    import sys

    from actors.logs.terminal import shown
    from cli.output import control, print_json

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
