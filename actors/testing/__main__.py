"""``python -m actors.testing explore MODULE:TREE``."""

import sys

from actors.testing.explore import main

if __name__ == "__main__":
    if sys.argv[1:2] != ["explore"]:
        sys.exit("usage: python -m actors.testing explore MODULE:TREE [options]; -h after `explore` shows them")
    sys.exit(main(sys.argv[2:]))
