"""Moving AI grid maps: are our shortest paths exact, and how long do they take? `python -m tests.figures maps FOLDER`.

With `--drawn` the maps are drawn from a seed instead: dense fields and narrow mazes of 512 x 512 cells.
"""

from __future__ import annotations

import statistics
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.command import UsageError
from robot.planning.errors import NavigationError
from robot.planning.grid import Cell
from robot.planning.path import pull
from robot.run.arguments import parse_seed, whole
from tests.figures.jump_points import GridPath, OctileSearch
from tests.figures.map_questions import Question, read_map, read_questions
from tests.figures.map_worlds import KINDS, drawn, questions_on
from tests.figures.measurement import Measurement, Result, add_running, heading
from tests.figures.trials import each

QUESTIONS = 200
"""On each map that is drawn."""


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
    wrong: Sequence[str]
    """The first rows that were not exact."""


def evaluate(path: Path, limit: int | None = None) -> MapReport:
    """Answer the questions beside a `.map` file (its name plus ``.scen``); with `limit`, that many spread over all
    rows.
    """
    questions = list(read_questions(path.with_name(path.name + ".scen")))
    if limit is not None and limit < len(questions):
        questions = [questions[i * len(questions) // limit] for i in range(limit)]
    return answer(path.name, read_map(path), questions)


def draw(kind: str, seed: int, size: int, many: int) -> MapReport:
    """Answer `many` questions on a map that is drawn, of `size` x `size` cells."""
    free = drawn(kind, seed, size)
    return answer(f"{kind}, seed {seed}", free, questions_on(free, seed, many))


def answer(name: str, free: NDArray[np.bool_], questions: Sequence[Question]) -> MapReport:
    """Answer questions about one map."""
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
            found = search.solve(question.start, question.goal)
        except NavigationError as error:
            if not question.pathless:
                wrong.append(f"{question}: {error}")
            continue
        times.append(time.process_time() - begun)
        expansions += found.expanded
        if question.pathless or not question.agrees(found.cost):
            wrong.append(f"{question}: {found.cost:.6f}")
        ratios.append(_pulled(found, weights))
    total = sum(times)
    return MapReport(
        map=name,
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


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    reports = [MapReport(**held) for held in result["maps"]]
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
    total = sum(r.total_s for r in reports)
    lines += [
        f"{exact} / {rows} rows exact in {total:.1f} s, {1e3 * total / max(rows, 1):.2f} ms a row; "
        f"the slowest took {max(r.worst_ms for r in reports):.0f} ms (excellent: all exact, 250 ms on 1024 x 1024 cells)",
        heading(result),
    ]
    return "\n".join(lines)


def _maps_in(folder: Path) -> list[Path]:
    """Raises `UsageError` when there is none with questions."""
    maps = [folder] if folder.is_file() else sorted(folder.glob("*.map"))
    maps = [path for path in maps if path.with_name(path.name + ".scen").exists()]
    if not maps:
        raise UsageError(
            f"{folder} holds no .map file with a .map.scen beside it" if folder.exists() else f"there is no {folder}"
        )
    return maps


def _evaluate(path: str, limit: int | None) -> dict[str, Any]:
    return asdict(evaluate(Path(path), limit))


def _draw(kind: str, seed: int, size: int, many: int) -> dict[str, Any]:
    return asdict(draw(kind, seed, size, many))


def _take(asked: Namespace) -> Result:
    if (asked.folder is None) == (asked.drawn is None):
        raise UsageError("give a folder, or --drawn")
    run: Callable[[str], dict[str, Any]]
    if asked.drawn is not None:
        names, many = list(asked.drawn or KINDS), asked.limit or QUESTIONS
        run = partial(_draw, seed=asked.seed, size=asked.size, many=many)
        what = f"maps drawn by seed {asked.seed}, {asked.size} cells, {many} questions"
    else:
        names, run = [str(path) for path in _maps_in(asked.folder)], partial(_evaluate, limit=asked.limit)
        what = f"maps, limit {asked.limit}"
    with closing(each(run, names, jobs=asked.jobs, file=asked.resume, what=what)) as told:
        maps = list(told)
    return Result({"maps": maps}, show, all(one["exact"] == one["rows"] for one in maps))


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "folder", type=Path, nargs="?", help="folder with NAME.map and NAME.map.scen files, or one .map file"
    )
    parser.add_argument(
        "--drawn", nargs="*", choices=tuple(KINDS), metavar="KIND", help=f"maps that are drawn instead: {', '.join(KINDS)} (all)"
    )  # fmt: skip
    parser.add_argument("--seed", type=parse_seed, default=1, help="of maps that are drawn (default 1)")
    parser.add_argument(
        "--size", type=whole(8, 4096), default=512, metavar="CELLS", help="of their sides (default 512)"
    )
    add_running(parser)
    parser.add_argument(
        "--limit",
        type=int,
        metavar="N",
        help="at most N rows of each scenario, evenly spread; with --drawn so many questions a map",
    )


MEASUREMENT = Measurement(
    "maps", "MovingAI benchmark maps: exact path lengths and search speed", "minutes to hours", _arguments, _take
)
