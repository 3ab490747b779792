"""Moving AI grid maps: are our shortest paths exact, and how long do they take? `python -m robot evaluate maps FOLDER`.

Formats: https://movingai.com/benchmarks/formats.html. A `.map` holds rows of cells (``.``, ``G`` and ``S`` are passable
here; water only from water, so it is not entered); a `.scen` holds one question a row, with the length of its shortest
path at the end.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robot.evaluate.jump_points import GridPath, OctileSearch
from robot.evaluate.levels import machine
from robot.planning.errors import NavigationError
from robot.planning.grid import Cell
from robot.planning.path import pull
from robot.run.arguments import Parser
from robot.run.errands import UsageError

__all__ = ["MapReport", "Question", "evaluate", "main", "read_map", "read_questions"]

_PASSABLE = ".GS"


@dataclass(frozen=True, slots=True)
class Question:
    """One row of a scenario: cells as (row, column), row 0 on top; the length of the shortest path in cells."""

    start: Cell
    goal: Cell
    length: float

    @property
    def pathless(self) -> bool:
        """Whether the file says that there is no way: it writes a length of 0 between two different cells."""
        return self.length == 0.0 and self.start != self.goal

    def agrees(self, cost: float) -> bool:
        """The rounding that the files allow: 1e-4 of the length plus 5e-3."""
        return abs(cost - self.length) <= 1e-4 * self.length + 5e-3


@dataclass(frozen=True, slots=True)
class MapReport:
    """What one map's questions gave. Times are processor times of this machine now: other programs hardly change them."""

    map: str
    width: int
    height: int
    rows: int
    exact: int
    build_ms: float
    median_ms: float
    worst_ms: float
    total_s: float
    expansions: int
    expansions_per_s: float
    any_angle: float
    """Mean of length pulled straight / octile length; collision-free at half-cell sampling."""
    wrong: tuple[str, ...]
    """The first rows that were not exact."""


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


def evaluate(path: Path, limit: int | None = None) -> MapReport:
    """Answer the questions beside a `.map` file (its name plus ``.scen``); with `limit`, that many spread over all
    rows.
    """
    free = read_map(path)
    questions = list(read_questions(path.with_name(path.name + ".scen")))
    if limit is not None and limit < len(questions):
        questions = [questions[i * len(questions) // limit] for i in range(limit)]
    begun = time.process_time()
    search = OctileSearch(free, landmarks=True)
    build = time.process_time() - begun
    times: list[float] = []
    wrong: list[str] = []
    ratios: list[float] = []
    expansions = 0
    weights = np.where(free, 1.0, np.inf)
    for question in questions:
        begun = time.process_time()
        try:
            answer = search.solve(question.start, question.goal)
        except NavigationError as error:
            if not question.pathless:
                wrong.append(f"{question}: {error}")
            continue
        times.append(time.process_time() - begun)
        expansions += answer.expanded
        if question.pathless or not question.agrees(answer.cost):
            wrong.append(f"{question}: {answer.cost:.6f}")
        ratios.append(_pulled(answer, weights))
    total = sum(times)
    return MapReport(
        map=path.name,
        width=free.shape[1],
        height=free.shape[0],
        rows=len(questions),
        exact=len(questions) - len(wrong),
        build_ms=1e3 * build,
        median_ms=1e3 * statistics.median(times) if times else 0.0,
        worst_ms=1e3 * max(times, default=0.0),
        total_s=total,
        expansions=expansions,
        expansions_per_s=expansions / total if total else 0.0,
        any_angle=statistics.fmean(ratios) if ratios else 1.0,
        wrong=tuple(wrong[:5]),
    )


def _pulled(answer: GridPath, weights: NDArray[np.float64]) -> float:
    """Length of the path pulled straight / its octile length."""
    if answer.cost == 0.0:
        return 1.0
    chain = np.array(pull(list(_each_cell(answer.cells)), weights), dtype=np.float64)
    return float(np.hypot(*np.diff(chain, axis=0).T).sum()) / answer.cost


def _each_cell(turns: Sequence[Cell]) -> Iterator[Cell]:
    """Every cell of a path given by its turning cells."""
    yield turns[0]
    for (row, column), (to_row, to_column) in pairwise(turns):
        steps = max(abs(to_row - row), abs(to_column - column))
        for k in range(1, steps + 1):
            yield row + (to_row - row) * k // steps, column + (to_column - column) * k // steps


def _text(reports: Sequence[MapReport]) -> str:
    lines = [
        f"{'map':<24}{'cells':>12}{'exact':>16}{'build ms':>10}{'median ms':>11}{'worst ms':>10}{'jump points/s':>15}{'any-angle':>11}"
    ]
    for r in reports:
        lines.append(
            f"{r.map:<24}{f'{r.width} x {r.height}':>12}{f'{r.exact} / {r.rows}':>16}{r.build_ms:>10.1f}{r.median_ms:>11.2f}"
            f"{r.worst_ms:>10.1f}{r.expansions_per_s:>15,.0f}{r.any_angle:>11.4f}"
        )
        lines += [f"  not exact: {row}" for row in r.wrong]
    rows, exact = sum(r.rows for r in reports), sum(r.exact for r in reports)
    total, here = sum(r.total_s for r in reports), machine()
    lines += [
        f"{exact} / {rows} rows exact in {total:.1f} s, {1e3 * total / max(rows, 1):.2f} ms a row; "
        f"the slowest took {max(r.worst_ms for r in reports):.0f} ms (excellent: all exact, 250 ms on 1024 x 1024 cells)",
        f"{date.today().isoformat()}; {here['processor']}, {here['cores']} cores, Python {here['python']}",
    ]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the maps of a folder and print the figures; 0 when every row is exact, 1 when not. Raises `UsageError` when there is
    nothing to run.
    """
    parser = Parser(
        prog="python -m robot evaluate maps", description="Exactness and speed of path search on Moving AI maps."
    )
    parser.add_argument("folder", type=Path, help="folder with NAME.map and NAME.map.scen files, or one .map file")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--limit", type=int, metavar="N", help="at most N rows of each scenario, evenly spread")
    options = parser.parse_args(argv)
    folder: Path = options.folder
    maps = [folder] if folder.is_file() else sorted(folder.glob("*.map"))
    maps = [path for path in maps if path.with_name(path.name + ".scen").exists()]
    if not maps:
        raise UsageError(
            f"{folder} holds no .map file with a .map.scen beside it" if folder.exists() else f"there is no {folder}"
        )
    reports = [evaluate(path, options.limit) for path in maps]
    if options.json:
        told = {"date": date.today().isoformat(), "machine": machine(), "maps": [asdict(report) for report in reports]}
        print(json.dumps(told, indent=2))
    else:
        print(_text(reports))
    return 0 if all(report.exact == report.rows for report in reports) else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["maps", *sys.argv[1:]]))
