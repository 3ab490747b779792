"""The command ``python -m actors.testing explore MODULE:TREE``."""

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

USAGE = "usage: python -m actors.testing explore MODULE:TREE [options]; -h after `explore` shows them"


def run(argv: Sequence[str]) -> NoReturn:
    """Run the command line `argv` and exit."""
    if argv[:1] in (["-h"], ["--help"]):
        print(USAGE)
        sys.exit(0)
    if argv[:1] != ["explore"]:
        sys.exit(USAGE)
    from actors.testing.explore import main  # imported late because it is slow to import

    sys.exit(main(argv[1:]))


if __name__ == "__main__":
    if "PYTHONHASHSEED" not in os.environ and os.name == "posix" and sys.argv[1:2] == ["explore"]:
        # The iteration order of a set of names is part of a run, and a replay happens in another process.
        os.environ["PYTHONHASHSEED"] = "0"
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
    run(sys.argv[1:])
