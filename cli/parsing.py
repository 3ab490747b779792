"""What the parsers of all groups share: how they are made, and the values that options take."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeAlias

from cli.command import Exit

__all__ = [
    "TRUNCATED",
    "Verb",
    "Verbs",
    "actions_of",
    "add_common",
    "add_graph_options",
    "add_interfaces",
    "add_json",
    "add_style",
    "complain",
    "count",
    "natural",
    "parsed",
    "positive",
    "positive_float",
    "until_signal",
]

TRUNCATED = 128
"""How many items of an array and characters of a text are printed, if nothing else is asked for."""

NARROW = 60
"""The columns of a narrow terminal."""

Verb: TypeAlias = "Callable[[argparse.Namespace], Coroutine[Any, Any, int | Exit] | int | Exit]"
"""Carries out a verb with its options."""


class Verbs:
    """The parser of one group: ``add`` its verbs, then ``run`` the one that is asked for."""

    def __init__(self, group: str, description: str) -> None:
        self.parser = argparse.ArgumentParser(prog=f"python -m robot {group}", description=description)
        self.parser.set_defaults(load=None)
        self.parsers: dict[str, argparse.ArgumentParser] = {}
        """Those of its verbs, by name."""
        self._verbs = self.parser.add_subparsers(dest="verb", metavar="VERB")

    def add(self, name: str, help: str, load: Callable[[], Verb]) -> argparse.ArgumentParser:
        """The parser of a verb. `load` imports what carries it out, once it is known that it is wanted."""
        parser = self._verbs.add_parser(name, help=help, description=help)
        parser.set_defaults(load=load)
        self.parsers[name] = parser
        return parser

    def run(self, argv: Sequence[str]) -> int | Exit:
        """Run the verb that the words ask for; without a verb, print the help."""
        if threading.current_thread() is threading.main_thread():
            # Until the verb runs, Ctrl-C simply ends the process: there is nothing yet to be ended in order.
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        for parser in self.parsers.values():
            parser.usage = _usage(parser)
        options = self.parser.parse_args(list(argv))
        if options.load is None:
            self.parser.print_help()
            return Exit.DONE
        verb: Verb = options.load()
        ended = verb(options)
        if isinstance(ended, (int, Exit)):
            return ended
        import asyncio  # late, so that no help waits for it

        return asyncio.run(until_signal(ended))


def parsed(parser: argparse.ArgumentParser, argv: Sequence[str]) -> argparse.Namespace:
    """The options in these words. The usage is without the options, so that it fits into a narrow terminal."""
    parser.usage = _usage(parser)
    return parser.parse_args(list(argv))


def actions_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options and positional arguments of a parser, in order."""
    return parser._actions  # pyright: ignore[reportPrivateUsage]  # argparse has no other way to ask


def _usage(parser: argparse.ArgumentParser) -> str:
    """Without the options, which are listed below it; two lines if one is too long."""
    forms = {"?": "[{}]", "*": "[{} ...]", "+": "{} [...]"}
    names = [
        forms.get(str(action.nargs), "{}").format(action.metavar or action.dest)
        for action in actions_of(parser)
        if not action.option_strings
    ]
    begin, end = f"{parser.prog} [options]", " ".join(names)
    return f"{begin} {end}" if len(begin) + len(end) < NARROW - len("usage: ") else f"{begin}\n       {end}"


async def until_signal(verb: Coroutine[Any, Any, int | Exit]) -> int | Exit:
    """Run a verb. A signal, or the end of whoever reads its output, cancels it, so that it takes its leave of the graph; a second signal,
    half a second or more after the first, ends the process at once."""
    import asyncio

    task = asyncio.current_task()
    assert task is not None
    came: list[int] = []

    def end(number: int) -> bool:
        if came:
            os._exit(128 + number)
        came.append(number)
        task.cancel()
        return True

    leave: Callable[[], None] = lambda: None  # noqa: E731
    if threading.current_thread() is threading.main_thread():
        from actors.running.signals import listen

        leave = listen(asyncio.get_running_loop(), end)
    try:
        return await verb
    except asyncio.CancelledError:
        if not came:
            raise
        return Exit.by(came[0])
    finally:
        leave()


def add_json(parser: argparse.ArgumentParser) -> None:
    """The option that makes the output one JSON value, or one a line."""
    parser.add_argument("--json", action="store_true", help="print JSON")


def positive(text: str) -> int:
    """A whole number above 0."""
    number = int(text) if text.isascii() and text.isdigit() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number above 0")
    return number


def natural(text: str) -> int:
    """A whole number from 0."""
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 0")
    return int(text)


def positive_float(text: str) -> float:
    """A finite number above 0."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return number


def count(number: int, noun: str) -> str:
    """``1 node``, ``2 nodes``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def complain(text: str) -> None:
    """A line for the user that is no part of the output."""
    print(text, file=sys.stderr, flush=True)


def add_graph_options(parser: argparse.ArgumentParser) -> None:
    """The options of every command that looks at the graph."""
    group = parser.add_argument_group("network")
    group.add_argument(
        "--spin-time", type=float, default=0.5, metavar="S", help="look for other processes at most S seconds (0.5)"
    )
    group.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="also connect to tcp/HOST:PORT"
    )
    group.add_argument(
        "--listen", action="append", default=[], metavar="ENDPOINT", help="let others connect to tcp/HOST:PORT"
    )
    group.add_argument("--security", metavar="FILE", help="TLS, and who may do what (docs/security.md)")
    group.add_argument("--no-daemon", action="store_true", help="accepted for ros2's sake: there is no daemon")


def add_common(parser: argparse.ArgumentParser) -> None:
    """The options of the verbs that look at the graph and at types."""
    add_graph_options(parser)
    group = parser.add_argument_group("time and types")
    group.add_argument(
        "-s",
        "--use-sim-time",
        action="store_true",
        help="topic delay and hz: by the time of /clock; other commands use the time of day",
    )
    add_interfaces(group)


def add_interfaces(to: argparse._ActionsContainer) -> None:  # pyright: ignore[reportPrivateUsage]  # parsers and groups of options
    """The option for definitions of types that are not known here."""
    to.add_argument(
        "--interfaces", action="append", default=[], metavar="DIR", help="types of DIR/PACKAGE/msg/NAME.msg, and so on"
    )


def add_style(parser: argparse.ArgumentParser) -> None:
    """How much of a message is printed, and in which form."""
    parser.add_argument("--csv", action="store_true", help="all values of a message, separated by commas")
    parser.add_argument("-f", "--full-length", action="store_true", help="print long arrays and texts whole")
    parser.add_argument(
        "-l", "--truncate-length", type=natural, default=TRUNCATED, metavar="N", help=f"cut them after N ({TRUNCATED})"
    )
    parser.add_argument("--no-arr", action="store_true", help="do not print arrays")
    parser.add_argument("--no-str", action="store_true", help="do not print texts")
    parser.add_argument("--flow-style", action="store_true", help="each message on one line")
