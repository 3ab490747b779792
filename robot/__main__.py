"""`python -m robot`: the words of the command line. Each one is loaded when it is used, so that `--help` is quick."""

from __future__ import annotations

import sys
from collections.abc import Sequence

USAGE = """\
usage: python -m robot COMMAND [options]     (the console script `robactor` is the same)

commands:
  run        run the whole robot in a world: stand up, walk, dock, sit      run --help for its options
  evaluate   measure it: evaluate walk | odometry | maps | barn | battery | arm | rates     evaluate walk --help
  picture    render the robot, its map and its path to PNG                  picture --help
  node       the nodes of the running graph, from any terminal              node list
  topic      its topics, and what is sent on them                           topic list | echo
  bag        recordings, as those of ros2 bag                                bag record | play | info | ...
  top        hosts, processes and nodes, live                             top --once | --json
  security   certificates, and who may do what                            security create | show | check
  router     a meeting point for several machines                           router --help

options:
  -h, --help, --version
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 2 not understood, 3 a supervisor gave up, 130 Ctrl-C."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(USAGE, end="")
        return 0
    command, rest = arguments[0], arguments[1:]
    if command == "--version":
        from importlib.metadata import version

        print(version("robactor"))
        return 0
    if command == "run":
        from robot.run.command import main as run_main

        return run_main(rest)
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

    hint = did_you_mean(command, ("run", "evaluate", "picture", *GROUPS), quoted=False)
    print(f"robot: there is no command {command!r}{hint} (see python -m robot --help)", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
