"""The program `robactor`, from its words to its exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from cli.starting import end_at_signals, leave

TYPE_CHECKING = False  # as that of `typing`, which takes a while to import

NAMES = 14
"""The columns of a command's name in the help, with the space behind it."""


def console() -> None:
    """Run one command, and exit; 1 if the package `robot` is another project's.

    Until a command is ready to end in order, a signal ends it at once and without a word. A command that looks at the graph exits without
    the interpreter's own end: threads that are still opening a network connection do not survive that. What is registered for the end is called.
    """
    end_at_signals()
    hidden = other_robot()
    if hidden is not None:
        sys.exit(f"robactor: {hidden}")
    code = main(sys.argv[1:])
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # the reader of our output has gone
        leave(code)
    if "actors.transport" in sys.modules:
        leave(code)
    sys.exit(code)


def main(argv: Sequence[str]) -> int:
    """Run one command; its exit code, 2 if there is none of that name."""
    if not argv or argv[0] in ("-h", "--help", "help"):
        print(usage(), end="")
        return 0
    if argv[0] == "--version":
        from importlib.metadata import version

        print(version("robactor"))
        return 0
    from cli.command import run_command

    return run_command(argv[0], argv[1:])


def usage() -> str:
    """The help of the program, at most 60 columns wide."""
    from cli.command import COMMANDS, CommandFailed, added, found

    lines: list[str] = []
    for entry in added():
        try:
            command = found(entry.name)
            help = command.help if command else ""
        except CommandFailed as failed:
            help = f"({failed})"
        lines.append(_line(entry.name, help))
    lines += [_line(name, help) for name, help in COMMANDS.items()]
    head = "usage: robactor COMMAND [options]\n       (python -m robot is the same)\n\ncommands:"
    return "\n".join((head, *lines, "", "COMMAND --help tells more. Options: -h, --help, --version\n"))


def _line(name: str, help: str) -> str:
    indent = "\n" + " " * (NAMES + 2)
    first = f"  {name:<{NAMES}}" if len(name) < NAMES else f"  {name}{indent}"
    return first + help.replace("\n", indent)


def other_robot() -> str | None:
    """A sentence with the remedy if what Python imports as `robot` is another project's, as Robot Framework's is; None if all is well."""
    try:
        import robot
    except ImportError as error:  # theirs, installed over ours: `robot.run` says so
        return str(error)
    ours = os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(__file__))), "robot", "__init__.py")
    found = os.path.realpath(robot.__file__ or "")
    if found == ours:
        return None
    return (
        f"the package robot that Python finds is another project's, {found}, and hides the robot's: install each in an environment "
        "of its own, or rename it if it is yours"
    )
