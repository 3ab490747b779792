"""The files of the Moving AI benchmarks: maps, and questions about them.

Formats: https://movingai.com/benchmarks/formats.html. A `.map` holds rows of cells (``.``, ``G`` and ``S`` are passable here; water only from
water, so it is not entered); a `.scen` holds one question a row, with the length of its shortest path at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robot.planning.grid import Cell

_PASSABLE = ".GS"


@dataclass(frozen=True, slots=True)
class Question:
    """One row of a scenario: cells as (row, column), row 0 on top; the length of the shortest path in cells."""

    start: Cell
    goal: Cell
    length: float

    @property
    def pathless(self) -> bool:
        """Whether the file names no way: it writes a length of 0 between two different cells."""
        return self.length == 0.0 and self.start != self.goal

    def agrees(self, cost: float) -> bool:
        """The rounding that the files allow: 1e-4 of the length plus 5e-3."""
        return abs(cost - self.length) <= 1e-4 * self.length + 5e-3


def read_map(path: Path) -> NDArray[np.bool_]:
    """Passable cells of a `.map` file, shape (height, width). Raises `ValueError` with the file's name."""
    head, found, body = path.read_text(encoding="ascii").partition("map\n")
    rows = body.splitlines() if found else []
    sizes = dict(line.split() for line in head.splitlines() if line.startswith(("height", "width")))
    width, height = int(sizes.get("width", -1)), int(sizes.get("height", -1))
    rows = rows[:height]
    if len(rows) != height or any(len(row) != width for row in rows):
        raise ValueError(f"{path} is not a Moving AI map: it promises {width} x {height} cells and holds other rows")
    return np.array([[cell in _PASSABLE for cell in row] for row in rows])


def read_questions(path: Path) -> Iterator[Question]:
    """The rows of a `.scen` file. Raises `ValueError` with file and line."""
    for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), start=1):
        if not line.strip() or line.startswith("version"):
            continue
        columns = line.split()
        if len(columns) != 9:
            raise ValueError(f"{path}:{number} has {len(columns)} columns; a scenario row has 9")
        x0, y0, x1, y1 = map(int, columns[4:8])
        yield Question((y0, x0), (y1, x1), float(columns[8]))
