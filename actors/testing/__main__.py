"""``python -m actors.testing explore MODULE:TREE``."""

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from actors.testing.explore import main

__all__ = ["run"]


def run(argv: Sequence[str]) -> NoReturn:
    """The program."""
    if argv[:1] != ["explore"]:
        sys.exit("usage: python -m actors.testing explore MODULE:TREE [options]; -h after `explore` shows them")
    sys.exit(main(argv[1:]))


if __name__ == "__main__":
    if "PYTHONHASHSEED" not in os.environ and os.name == "posix":
        # the order of a set of names is part of a run, and a replay is another process
        os.environ["PYTHONHASHSEED"] = "0"
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
    run(sys.argv[1:])
