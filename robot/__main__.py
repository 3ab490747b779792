"""`python -m robot`: the words of the command line. Each one is loaded when it is used, so that `--help` is quick."""

from __future__ import annotations

import os
import sys

from robot.starting import end_at_signals, interruptible

if __name__ == "__main__":
    end_at_signals()  # what is imported takes a while

TYPE_CHECKING = False  # as that of `typing`, which takes a while to import
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from actors import System

OWN = {
    "run": "the whole robot in a world; or an executable,\n             run PACKAGE EXECUTABLE, run MODULE:NODE",
    "evaluate": "measure it: walk, odometry, maps, battery, ...",
    "picture": "render robot, map and path to PNG",
}
"""The commands that are no verbs of `ros2`, with a line of help."""


def usage() -> str:
    """The help of the program, at most 60 columns wide."""
    from cli.command import GROUPS

    lines = [f"  {name:<10} {help}" for name, help in (*OWN.items(), *GROUPS.items())]
    head = "usage: python -m robot COMMAND [options]\n       (the console script robactor is the same)\n\ncommands:"
    tail = "COMMAND --help tells more. Options: -h, --help, --version\n"
    return "\n".join((head, *lines, "", tail))


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 2 not understood, 3 a supervisor gave up, 130 Ctrl-C."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(usage(), end="")
        return 0
    command, rest = arguments[0], arguments[1:]
    if command == "--version":
        from importlib.metadata import version

        print(version("robactor"))
        return 0
    if command == "run" and rest and (not rest[0].startswith("-") or rest[0] in ("--prefix", "--package-path")):
        from cli.command import run_group as run_executable

        return run_executable("run", rest)
    if command == "run":
        from robot.run.command import main as run_main

        return run_main(rest, _serve_web)
    if command in OWN:
        interruptible()
    if command == "evaluate":
        from robot.evaluate.command import main as evaluate_main

        return evaluate_main(rest)
    if command == "picture":
        from robot.picture import main as picture_main

        return picture_main(rest)
    from cli.command import GROUPS, run_group  # late, as all else

    if command in GROUPS:
        return run_group(command, rest)
    from actors.suggest import did_you_mean

    hint = did_you_mean(command, (*OWN, *GROUPS), quoted=False)
    print(f"robot: there is no command {command!r}{hint} (see python -m robot --help)", file=sys.stderr)
    return 2


async def _serve_web(system: System, **options: Any) -> None:
    from cli.web.beside import serve_beside

    await serve_beside(system, **options)


def console() -> None:
    """The program `robactor`: run one command, and exit.

    Until a command is ready to end in order, a signal ends it at once and without a word. A command that looks at the graph exits without
    the interpreter's own end: threads that are still opening a network connection do not survive that.
    """
    end_at_signals()
    code = main()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # who read our output has gone
        os._exit(code)
    if "cli.command" in sys.modules:
        os._exit(code)
    sys.exit(code)


if __name__ == "__main__":
    console()
