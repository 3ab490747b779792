"""The maps that `tests.figures maps --drawn` draws, and the lengths that it holds answers against."""

from __future__ import annotations

from collections import deque
from math import sqrt

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import lil_matrix
from scipy.sparse.csgraph import dijkstra

from tests.figures.__main__ import main
from tests.figures.map_worlds import KINDS, drawn, questions_on


def reached(free: NDArray[np.bool_]) -> int:
    """Cells that steps along rows and columns join to the first free one."""
    first = tuple(np.argwhere(free)[0].tolist())
    seen, waiting = {first}, deque([first])
    while waiting:
        row, column = waiting.popleft()
        for there in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= there[0] < free.shape[0] and 0 <= there[1] < free.shape[1]
            if inside and free[there] and there not in seen:
                seen.add(there)
                waiting.append(there)
    return len(seen)


def test_a_perfect_maze_joins_all_rooms_and_has_no_loop() -> None:
    free = drawn("maze-1", 3, 41)
    assert reached(free) == free.sum()
    # A tree: as many doors between its rooms as rooms, less one; rooms and doors are all the free cells there are.
    assert free.sum() == 2 * 20 * 20 - 1
    assert drawn("maze-braided", 3, 41).sum() > free.sum() + 10


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_seed_gives_one_map(kind: str) -> None:
    free = drawn(kind, 1, 65)
    assert (free == drawn(kind, 1, 65)).all()
    assert not (free == drawn(kind, 2, 65)).all()
    share = KINDS[kind]
    if share is not None:
        assert 1.0 - free.mean() == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("kind", ["dense-30", "maze-braided"])
def test_the_lengths_of_the_questions_are_those_that_scipy_finds(kind: str) -> None:
    free = drawn(kind, 5, 31)
    size = free.shape[0]
    graph = lil_matrix((size * size, size * size))
    for row, column in np.argwhere(free).tolist():
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            r, c = row + down, column + right
            if 0 <= r < size and 0 <= c < size and free[r, c] and free[row, c] and free[r, column]:
                graph[row * size + column, r * size + c] = sqrt(down * down + right * right)
    questions = questions_on(free, 1, 20)
    assert len(questions) == 20
    for one in questions:
        lengths = dijkstra(graph.tocsr(), directed=False, indices=one.start[0] * size + one.start[1])
        assert one.length == pytest.approx(lengths[one.goal[0] * size + one.goal[1]])


def test_drawn_maps_are_answered_exactly(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["maps", "--drawn", "dense-36", "maze-1", "--size", "64", "--limit", "20"]) == 0
    assert "40 / 40 rows exact" in capsys.readouterr().out
