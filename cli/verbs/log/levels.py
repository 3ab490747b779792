"""`log --levels` and `log --set`: the levels of the loggers of nodes that serve them."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from actors import Service
from actors.interfaces.rcl_interfaces.msg import LoggerLevel
from actors.interfaces.rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from actors.logs.levels import Level
from actors.names.names import logger_name
from cli.command import CommandFailed, Exit
from cli.graph.asking import ask, node_names
from cli.graph.seen import Seen, seen
from cli.output import print_json
from cli.parsing import complain

GET, SET = "get_logger_levels", "set_logger_levels"
REMEDY = "start it with --ros-args -p enable_logger_service:=true"


async def show(options: argparse.Namespace) -> Exit:
    """Print the level of each node's logger, as far as one has been set, and of its process, with an empty name."""
    found: dict[str, dict[str, str]] = {}
    async with seen(options) as graph:
        for node in await _serving(graph, GET, options.node, options):
            names = ("", logger_name(node))
            service = Service(GetLoggerLevels, f"{node}/{GET}")
            answer = await ask(graph, node, service, GetLoggerLevels.Request(names=names), options)
            found[node] = {one.name: _word(one.level) for one in answer.levels}
    if options.json:
        print_json(found)
        return Exit.DONE
    for node, levels in found.items():
        own = levels.get(logger_name(node), "unset")
        print(f"{node}: {own}" if own != "unset" else f"{node}: {levels.get('', 'unset')} (that of its process)")
    return Exit.DONE


async def set_levels(options: argparse.Namespace) -> Exit:
    """Set levels, each written as LEVEL, for all, or LOGGER:=LEVEL, in the process of the nodes of that name or below it."""
    wanted = [_parsed(text) for text in options.set]
    ended = Exit.DONE
    async with seen(options) as graph:
        for logger, level in wanted:
            for node in await _serving(graph, SET, [logger] if logger else [], options):
                request = SetLoggerLevels.Request(levels=(LoggerLevel(name=logger, level=level),))
                answer = await ask(graph, node, Service(SetLoggerLevels, f"{node}/{SET}"), request, options)
                for result in answer.results:
                    if not result.successful:
                        complain(f"{node}: {result.reason}")
                        ended = Exit.REFUSED
                    else:
                        print(f"{logger or 'all loggers'} of the process of {node}: {_word(level)}")
    return ended


def _parsed(text: str) -> tuple[str, Level]:
    """The logger and the level of ``LOGGER:=LEVEL``; the logger is empty for ``LEVEL``. Raises `CommandFailed`."""
    logger, _, level = text.rpartition(":=")
    try:
        return logger_name(logger.rstrip("/")).lstrip("."), Level.parse(level)
    except ValueError as error:
        raise CommandFailed(f"--set {text}: {error}") from None


async def _serving(graph: Seen, service: str, wanted: Iterable[str], options: argparse.Namespace) -> list[str]:
    """The nodes that serve levels: those that are wanted, by name or namespace, or all. Raises `CommandFailed` if there is none."""
    loggers = [f"{logger_name(name.rstrip('/'))}." for name in wanted]

    def nodes() -> list[str]:
        names = node_names(graph)
        return [
            node for node in names if not loggers or any(f"{logger_name(node)}.".startswith(one) for one in loggers)
        ]

    def serving() -> list[str]:
        return [node for node in nodes() if f"{node}/{service}" in graph.system.graph.services]

    if not await graph.late(lambda: bool(serving()), options.spin_time):
        found = nodes()
        raise CommandFailed(
            f"{', '.join(found)}: no logger service; {REMEDY}"
            if found
            else f"Node not found: {', '.join(wanted) or 'there is none'}"
        )
    return serving()


def _word(level: int) -> str:
    return {each.value: each.name.lower() for each in Level}.get(level, str(level))
