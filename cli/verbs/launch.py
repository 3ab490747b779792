"""`launch PACKAGE FILE [NAME:=VALUE ...]`: start what a launch file says, show its tree, or check it."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from actors import SupervisorGaveUp, execute, run
from actors.launch import Launch, LaunchError, NotDone, Packages, run_script, starts_itself
from actors.logs import DEBUG, INFO, console_sink
from actors.suggest import did_you_mean
from actors.transport import WireUnavailable, transport_from_environment
from cli.command import CommandFailed
from cli.parsing import Parser, positive_float
from cli.verb import Verb

SUFFIXES = (".launch.py", ".launch.xml", ".launch.yaml", ".launch.yml", "_launch.py", "_launch.xml", "_launch.yaml")


def _run(options: argparse.Namespace) -> int:
    """Launch; the exit code: 0 when the launch has ended, 1 when it cannot be launched or `--check` has found something, 130 Ctrl-C."""
    try:
        packages = Packages(options.package_path)
    except OSError as error:
        raise CommandFailed(f"--package-path: {error}") from error
    path, words = _file(options.words, packages)
    given = arguments_of(words)
    arguments = {**_settings(options), **given}
    looks = options.show_args or options.show_tree or options.check
    if options.show_all:
        os.environ["OVERRIDE_LAUNCH_PROCESS_OUTPUT"] = "both"
    if starts_itself(path):
        if looks:
            raise CommandFailed(
                f"{path} starts its launch itself, so it can only be run: it has no generate_launch_description()"
            )
        return run_script(path, words, packages=packages, stand_ins=options.stand_ins)
    try:
        launch = Launch(path, arguments, packages=packages, argv=words, lenient=looks, stand_ins=options.stand_ins)
    except LaunchError as error:
        raise CommandFailed(str(error)) from error
    _warn(launch, given)
    if options.show_args:
        print(launch.show_arguments())
        return _told(launch, check=True) if launch.is_broken else 0
    if options.show_tree:
        print(launch.show())
    if looks:
        return _told(launch, check=options.check or launch.is_broken)
    for problem in launch.problems:
        print(f"warning: {problem}", file=sys.stderr)
    return _live(launch, options)


def _arguments(parser: Parser) -> None:
    add = parser.add_argument
    add("words", nargs="+", metavar="PACKAGE FILE | PATH", help="the launch file, then its arguments, name:=value")
    add("-s", "--show-args", "--show-arguments", action="store_true", help="list the arguments of the launch file")
    add(
        "-p",
        "--show-tree",
        "--print",
        "--print-description",
        dest="show_tree",
        action="store_true",
        help="print the supervisor tree that it comes to, and start nothing",
    )
    add("--check", action="store_true", help="say what is wrong, and start nothing; exit code 1 if anything is")
    add("--package-path", action="append", default=[], metavar="DIR", help="find packages in this folder, too")
    add("--stand-ins", action="store_true", help="let an empty node stand in for an executable that is not here")
    add("-d", "--debug", action="store_true", help="show debug lines")
    add(
        "-a",
        "--show-all-subprocesses-output",
        dest="show_all",
        action="store_true",
        help="show all output of processes",
    )
    add("-n", "--noninteractive", action="store_true", help="accepted for ros2's sake: launching never asks")
    add(
        "--launch-prefix",
        metavar="CMD",
        help="put this before the command of every process, such as 'gdb -ex run --args'",
    )
    add("--launch-prefix-filter", metavar="REGEX", help="only before those whose name it matches")
    add("--clock", choices=("real", "virtual"), default="real", help="virtual: waiting takes no time; nodes only")
    add("--duration", type=positive_float, metavar="SECONDS", help="end after so many seconds")


def _file(words: Sequence[str], packages: Packages) -> tuple[Path, Sequence[str]]:
    """The launch file, and the words after it. Raises `CommandFailed`."""
    first = Path(words[0])
    if first.is_file() or (len(words) == 1 or ":=" in words[1]):
        if not first.is_file():
            raise CommandFailed(f"there is no launch file {words[0]}; or write PACKAGE FILE")
        return first, words[1:]
    try:
        return packages.file(words[0], words[1], SUFFIXES), words[2:]
    except LookupError as error:
        raise CommandFailed(str(error.args[0])) from error


def arguments_of(words: Sequence[str]) -> dict[str, str]:
    """name:=value of each word; the last one counts. Raises `CommandFailed`."""
    found: dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(":=")
        if not separator or not name:
            raise CommandFailed(f"malformed launch argument {word!r}, expected format '<name>:=<value>'")
        found[name] = value
    return found


def _settings(options: argparse.Namespace) -> dict[str, str]:
    """The options that are launch configurations."""
    pairs = (("launch-prefix", options.launch_prefix), ("launch-prefix-filter", options.launch_prefix_filter))
    return {name: value for name, value in pairs if value is not None}


def _warn(launch: Launch, given: Mapping[str, str]) -> None:
    """Say which arguments the launch file does not declare: they may be slips, or for a file that it includes by chance."""
    for name in given:
        if name not in launch.arguments:
            near = did_you_mean(name, launch.arguments)
            print(f"warning: the launch file declares no argument {name!r}{near}", file=sys.stderr)


def _told(launch: Launch, *, check: bool) -> int:
    """Say what is wrong; the exit code."""
    lines: dict[str, list[str]] = {}
    for problem in launch.problems:
        lines.setdefault(problem.problem, []).append(str(problem.line) if problem.line is not None else "")
    wrong = launch.is_broken or any(not isinstance(problem, NotDone) for problem in launch.problems)
    for text, places in lines.items():
        more = f" (and {len(places) - 1} more)" if len(places) > 1 else ""
        print(f"{places[0]}{more}: {text}" if places[0] else text, file=sys.stderr)
    if check and not wrong:
        print("nothing else is wrong" if lines else "nothing is wrong")
    return 1 if check and wrong else 0


def _live(launch: Launch, options: argparse.Namespace) -> int:
    try:
        transport = None if options.clock == "virtual" else transport_from_environment(os.environ)
    except WireUnavailable as error:
        raise CommandFailed(str(error)) from error
    level = DEBUG if options.debug else INFO

    async def live() -> int:
        sinks = (console_sink(sys.stdout, level),)
        async with run(launch.tree(_write), sinks=sinks, level=level, transport=transport) as system:
            ended = asyncio.ensure_future(system.wait())
            try:
                await asyncio.wait([ended], timeout=options.duration)
                if ended.done():
                    ended.result()
            finally:
                ended.cancel()
        return system.exit_code

    try:
        return execute(live, clock=options.clock)
    except SupervisorGaveUp as error:
        raise CommandFailed(str(error)) from error


def _write(line: str) -> None:
    print(line, flush=True)


COMMAND = Verb(
    "launch",
    "start what a launch file says",
    _arguments,
    _run,
    description="Start what a launch file of ROS 2 says: Python, XML or YAML.",
    usage="%(prog)s [options] PACKAGE FILE\n       [NAME:=VALUE ...]\n       %(prog)s [options] PATH\n       [NAME:=VALUE ...]",
    epilog="Ctrl-C stops everything in reverse order.",
    parse=Parser.parse_intermixed_args,
)
