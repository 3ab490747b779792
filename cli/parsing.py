"""What the parsers of all verbs share: how they are made, and the values that options take."""

from __future__ import annotations

import argparse
import math
import sys
from typing import NoReturn

from cli.command import UsageError

TRUNCATED = 128
"""How many items of an array and characters of a text are printed, if nothing else is asked for."""

NARROW = 60
"""The columns of a narrow terminal."""


class Parser(argparse.ArgumentParser):
    """argparse, but a mistake raises `UsageError`: one line with the nearest option or choice, and where the help is."""

    def error(self, message: str) -> NoReturn:
        if message.startswith("unrecognized arguments: "):
            from actors.suggest import did_you_mean  # late: it brings the whole framework

            known = [option for action in self._actions for option in action.option_strings]
            near = (did_you_mean(word.partition("=")[0], known, quoted=False) for word in message.split()[2:])
            message += next(filter(None, near), "")
        raise UsageError(f"{message} (see {self.prog} --help)")

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            from actors.suggest import did_you_mean

            choices = [str(choice) for choice in action.choices]
            near = did_you_mean(str(value), choices, quoted=False) or f" (choose from {', '.join(choices)})"
            raise argparse.ArgumentError(action, f"invalid choice: {value!r}{near}")


def actions_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options and positional arguments of a parser, in order."""
    return parser._actions  # pyright: ignore[reportPrivateUsage]  # argparse has no other way to ask


def outline(parser: argparse.ArgumentParser) -> str:
    """The usage without the options, which are listed below it; two lines if one is too long for a narrow terminal."""
    forms = {"?": "[{}]", "*": "[{} ...]", "+": "{} [...]", "...": "..."}
    names = [
        forms.get(str(action.nargs), "{}").format(action.metavar or action.dest)
        for action in actions_of(parser)
        if not action.option_strings
    ]
    begin, end = f"{parser.prog} [options]", " ".join(names)
    return f"{begin} {end}".rstrip() if len(begin) + len(end) < NARROW - len("usage: ") else f"{begin}\n       {end}"


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


def port(text: str) -> int:
    """A TCP port; 0: any that is free."""
    if not (text.isascii() and text.isdigit() and int(text[:6]) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is no port from 0 to 65535")
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


def nonnegative_float(text: str) -> float:
    """A finite number, 0 or more."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 <= number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no number, 0 or more")
    return number


def count(number: int, noun: str) -> str:
    """``1 node``, ``2 nodes``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def complain(text: str) -> None:
    """A line for the user that is no part of the output; further lines of it, which others may have written, are indented."""
    print(text.replace("\n", "\n    "), file=sys.stderr, flush=True)


def add_graph_options(parser: argparse.ArgumentParser) -> None:
    """The options of every command that looks at the graph."""
    group = parser.add_argument_group("network")
    group.add_argument(
        "--spin-time",
        type=nonnegative_float,
        default=0.5,
        metavar="S",
        help="look for other processes at most S seconds (0.5)",
    )
    group.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="also connect to tcp/HOST:PORT"
    )
    group.add_argument(
        "--listen", action="append", default=[], metavar="ENDPOINT", help="let others connect to tcp/HOST:PORT"
    )
    group.add_argument("--security", metavar="FILE", help="TLS, and who may do what (docs/howto/security.md)")
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


def add_graph_verb(parser: argparse.ArgumentParser) -> None:
    """The options of every verb that looks at the graph and prints what it finds."""
    add_json(parser)
    add_common(parser)


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
