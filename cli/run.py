"""`run PACKAGE EXECUTABLE` and `run MODULE:NODE`: a node, or a program of an installed package."""

from __future__ import annotations

import argparse
import asyncio
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

from cli.command import CommandFailed, Exit
from cli.parsing import complain

if TYPE_CHECKING:
    from actors.launch.packages import Program
    from actors.logs import LogRecord
    from actors.typing import Spec

__all__ = ["main"]

PREFIX = "[robactor run]:"

VERBS = {("tf2_ros", "tf2_echo"): "cli.tf2_echo", ("tf2_tools", "view_frames"): "cli.view_frames"}
"""Programs of ROS 2 that are verbs here, and their modules."""


def main(argv: Sequence[str]) -> int | Exit:
    """Run what the words name until it ends, and return its exit code."""
    options = _options(argv)
    if ":" in options.package_name:
        return _run_nodes(options.package_name, [*_words(options.executable_name), *options.argv])
    if (verb := VERBS.get((options.package_name, options.executable_name))) is not None:
        ended: int | Exit = import_module(verb).main(options.argv)
        return ended
    from actors.launch.packages import NodeTarget, Packages, UnknownExecutable, UnknownPackage

    packages = Packages(options.package_path)
    try:
        if options.executable_name is None:
            names = ", ".join(packages.executables(options.package_name)) or "none"
            raise CommandFailed(f"which executable? {options.package_name} has: {names}")
        found = packages.find(options.package_name, options.executable_name)
    except UnknownPackage as error:
        raise CommandFailed(_sentence(error)) from None
    except UnknownExecutable as error:
        raise CommandFailed(f"No executable found: {error}") from None
    if not isinstance(found, NodeTarget):
        return _run_program(found, options)
    if options.prefix is not None:
        words = [*shlex.split(options.prefix), sys.executable, "-m", "robot", "run", found.target, *options.argv]
        return _run_process(words)
    return _run_nodes(found.target, options.argv)


def _options(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m robot run",
        description="Run an executable of a package, or a node, a tree, or a function that makes one.",
        epilog="What follows goes to it unchanged, such as --ros-args -r old:=new -p name:=value.",
    )
    parser.add_argument("--prefix", metavar="COMMAND", help="run it by this command, such as 'gdb -ex run --args'")
    parser.add_argument(
        "--package-path", action="append", default=[], metavar="DIR", help="a further folder of packages"
    )
    parser.add_argument("package_name", metavar="PACKAGE | MODULE:NODE")
    parser.add_argument("executable_name", nargs="?", metavar="EXECUTABLE")
    parser.add_argument("argv", nargs=argparse.REMAINDER, metavar="...")
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
    """Run a program; SIGINT and SIGTERM go to it. Its exit code, or 128 and the number of the signal that ended it."""
    process: subprocess.Popen[bytes] | None = None
    early: list[int] = []

    def forward(number: int, frame: object) -> None:
        if process is None:
            early.append(number)
        elif (
            process.poll() is None and number != signal.SIGINT
        ):  # Ctrl-C in a terminal has reached it: it belongs to the same group
            process.send_signal(number)

    # First the handlers: a signal that came between the start of the program and its handler would leave the program behind.
    before = {number: signal.signal(number, forward) for number in (signal.SIGINT, signal.SIGTERM)}
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


async def _live(make: Any, argv: Sequence[str]) -> int:
    from actors import ProgramExit, StartFailed, SupervisorGaveUp, run
    from actors.logs import console_sink
    from actors.running.target import grown
    from actors.transport import WireUnavailable, transport_from_environment

    failed: list[LogRecord] = []

    def note(record: LogRecord) -> None:
        if record.fields.get("errand") == "failed":
            failed.append(record)

    try:
        first, *more = [_significant(tree, argv) for tree in await grown(make)]
        transport = transport_from_environment(os.environ)
        sinks = (console_sink(sys.stdout), note)
        async with run(_whole(first, more), argv=argv, sinks=sinks, transport=transport) as system:
            await system.wait()
        return system.exit_code or int(bool(failed))
    except (StartFailed, SupervisorGaveUp) as error:
        raise CommandFailed(str(error)) from None
    except ProgramExit as error:
        return error.code
    except (WireUnavailable, ValueError) as error:
        _refuse(error)


def _refuse(error: Exception) -> NoReturn:
    raise CommandFailed(str(error)) from None


def _significant(tree: Any, argv: Sequence[str]) -> Spec:
    """A node that is run alone is a program: it ends with the node, and may take words of its own."""
    from actors import Child, transient
    from actors.running.options import with_own_arguments

    return (
        with_own_arguments(Child(tree, restart=transient, significant=True), argv) if isinstance(tree, type) else tree
    )


def _whole(first: Spec, more: Sequence[Spec]) -> Spec:
    from actors import Child, Intensity, Supervisor, all_significant, never

    children = [first, *more]
    if len(children) == 1 and not isinstance(first, Child):
        return first
    ends = any(isinstance(child, Child) and child.significant for child in children)
    # as a program of ROS 2, it is not started again after an error
    return Supervisor(
        "run", children=children, auto_shutdown=all_significant if ends else never, intensity=Intensity(0, within=1.0)
    )
