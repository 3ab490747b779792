"""``python -m actors.testing explore MODULE:TREE``."""

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
    run(sys.argv[1:])
