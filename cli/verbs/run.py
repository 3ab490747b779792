"""`run PACKAGE EXECUTABLE` and `run MODULE:NODE`: a node, or a program of an installed package."""

from __future__ import annotations

import argparse
import ast
import asyncio
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cli.command import CommandFailed, Exit, found
from cli.parsing import Parser, complain
from cli.verb import Verb

if TYPE_CHECKING:
    from actors.launch.packages import Program
    from actors.running.target import Maker

PREFIX = "[robactor run]:"

VERBS = {
    ("tf2_ros", "tf2_echo"): "tf2_echo",
    ("tf2_tools", "view_frames"): "view_frames",
    ("nav2_map_server", "map_saver_cli"): "map_saver_cli",
}
"""Programs of ROS 2 that are commands here."""

STATIC = ("tf2_ros", "static_transform_publisher")
"""The program that has options of its own, and so a help."""


def _run(options: argparse.Namespace) -> int | Exit:
    """Run what the words name until it ends, and return its exit code."""
    if ":" in options.package_name:
        words = [*_words(options.executable_name), *options.argv]
        if words and re.fullmatch(r"[^\W\d][\w.]*:[^\W\d]\w*", words[0]):
            complain(
                f"{PREFIX} {words[0]} is an argument of {options.package_name}, not a second node: "
                "run it in another terminal, or run a function that returns a Supervisor of both"
            )
        if words and re.match("--(?!ros-args)[a-z]", words[0]):
            complain(
                f"{PREFIX} {words[0]} is an argument of {options.package_name}, in system.argv; this command takes its own "
                "options before the name, and `--ros-args`"
            )
        return _run_nodes(options.package_name, words)
    if (options.package_name, options.executable_name) == STATIC and ("-h" in options.argv or "--help" in options.argv):
        from cli.verbs.static_transform_publisher import print_help

        return print_help()
    if (verb := found(VERBS.get((options.package_name, options.executable_name), ""))) is not None:
        return verb.main(options.argv)
    from actors.launch.packages import NodeTarget, Packages, UnknownExecutable, UnknownPackage

    packages = Packages(options.package_path)
    try:
        if options.executable_name is None:
            names = ", ".join(packages.executables(options.package_name)) or "none"
            raise CommandFailed(f"which executable? {options.package_name} has: {names}")
        target = packages.find(options.package_name, options.executable_name)
    except UnknownPackage as error:
        raise CommandFailed(_meant_file(options.package_name) or _sentence(error)) from None
    except UnknownExecutable as error:
        raise CommandFailed(f"No executable found: {error}") from None
    if not isinstance(target, NodeTarget):
        return _run_program(target, options)
    if options.prefix is not None:
        words = [*shlex.split(options.prefix), sys.executable, "-m", "robot", "run", target.target, *options.argv]
        return _run_process(words)
    return _run_nodes(target.target, options.argv)


def _arguments(parser: Parser) -> None:
    parser.add_argument("--prefix", metavar="COMMAND", help="run it by this command, such as 'gdb -ex run --args'")
    parser.add_argument(
        "--package-path", action="append", default=[], metavar="DIR", help="a further folder of packages"
    )
    parser.add_argument("package_name", metavar="PACKAGE | MODULE:NODE")
    parser.add_argument("executable_name", nargs="?", metavar="EXECUTABLE")
    parser.add_argument("argv", nargs=argparse.REMAINDER, metavar="...")


def _parse(parser: Parser, argv: Sequence[str]) -> argparse.Namespace:
    own, rest = _split(argv)
    options = parser.parse_args(own)
    options.argv = [*options.argv, *rest]
    return options


def _split(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """The words of this command, up to the executable, and those of the executable."""
    words = list(argv)
    index = wanted = 0
    while index < len(words) and words[index] != "--ros-args":
        if words[index] in ("--prefix", "--package-path"):
            index += 2
        elif words[index].startswith("-") and not wanted:
            index += 1
        else:
            wanted += 2 if ":" in words[index] else 1
            index += 1
            if wanted >= 2:
                break
    return words[:index], words[index:]


def _meant_file(word: str) -> str | None:
    """What to write for a file of Python that was named in place of a package; None if there is no such file."""
    path = Path(word if word.endswith(".py") else f"{word}.py")
    try:
        parsed = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        if not path.is_file():
            return None
        parsed = ast.Module(body=[], type_ignores=[])
    classes = [each for each in parsed.body if isinstance(each, ast.ClassDef)]
    nodes = [each.name for each in classes if any(ast.unparse(base).endswith("Node") for base in each.bases)]
    module = ".".join(path.with_suffix("").parts)
    ways = (
        " or ".join(f"{module}:{name}" for name in nodes[:3]) or f"{module}:NAME, where NAME is its node class or tree"
    )
    return f"{path} is a Python file, not a package; did you mean {ways}? As a program of its own: python {path}"


def _sentence(error: Exception) -> str:
    text = str(error)
    return text[:1].upper() + text[1:]


def _words(word: str | None) -> list[str]:
    return [] if word is None else [word]


# -- programs ----------------------------------------------------------------------------------------------------------------


def _run_program(program: Program, options: argparse.Namespace) -> int:
    prefix = shlex.split(options.prefix) if options.prefix is not None else []
    return _run_process([*prefix, str(program.path), *options.argv])


def _run_process(words: Sequence[str]) -> int:
    """Run a program; the signals that ask for an end go to it. Its exit code, or 128 and the number of the signal that ended it."""
    from actors.running.signals import ending_signals

    process: subprocess.Popen[bytes] | None = None
    early: list[int] = []

    def forward(number: int, frame: object) -> None:
        if process is None:
            early.append(number)
        # Ctrl-C in a terminal has reached it already: it belongs to the same group
        elif process.poll() is None and number != signal.SIGINT:
            process.send_signal(number)

    # First the handlers: a signal that came between the start of the program and its handler would leave the program behind.
    before = {number: signal.signal(number, forward) for number in ending_signals()}
    try:
        process = subprocess.Popen(words)
        for number in early:
            process.send_signal(number)
        code = process.wait()
    except OSError as error:
        raise CommandFailed(f"{words[0]} cannot be run: {error.strerror}") from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if code < 0:
        complain(f"{PREFIX} {signal.strsignal(-code)}")
        return 128 - code
    if code:
        complain(f"{PREFIX} Process exited with failure {code}")
    return code


# -- nodes -------------------------------------------------------------------------------------------------------------------


def _run_nodes(target: str, argv: Sequence[str]) -> int:
    from actors.running.target import Unusable, find

    try:
        return asyncio.run(_live(find(target), argv))
    except Unusable as error:
        raise CommandFailed(str(error)) from None


async def _live(make: Maker, argv: Sequence[str]) -> int:
    from actors import StartFailed, SupervisorGaveUp
    from actors.running.program import live
    from actors.running.target import grown
    from actors.transport import WireUnavailable

    try:
        return await live(await grown(make), argv)
    except (StartFailed, SupervisorGaveUp) as error:
        raise CommandFailed(str(error)) from None
    except (WireUnavailable, ValueError) as error:
        raise CommandFailed(str(error)) from None


COMMAND = Verb(
    "run",
    "an executable of a package, or a node",
    _arguments,
    _run,
    description="Run an executable of a package, or a node, a tree, or a function that makes one.",
    epilog="What follows goes to it unchanged, such as --ros-args -r old:=new -p name:=value.",
    parse=_parse,
)
