"""`python -m tests.tools.page_weight`: what the files of the web page weigh, as they are and as they are sent."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.tools import no_arguments

PAGE = Path(__file__).parents[2] / "cli" / "web" / "page"
SENT = {".html", ".js", ".css", ".svg"}
"""What a browser asks for."""


class Weight(NamedTuple):
    """Bytes of one file."""

    name: str
    plain: int
    packed: int


def weights(folder: Path = PAGE) -> Iterator[Weight]:
    """Every file that a browser may ask for."""
    for path in sorted(folder.rglob("*")):
        if path.suffix in SENT:
            data = path.read_bytes()
            yield Weight(path.relative_to(folder).as_posix(), len(data), len(gzip.compress(data)))


def main() -> None:
    """Print a line for each file, the heaviest first, and their sum."""
    found = sorted(weights(), key=lambda one: -one.packed)
    for one in [*found, Weight("all", sum(one.plain for one in found), sum(one.packed for one in found))]:
        print(f"{one.plain:>9,} {one.packed:>9,}  {one.name}")


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
