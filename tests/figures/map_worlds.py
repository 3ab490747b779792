"""Maps that are hard to search, drawn from a seed: dense fields of single cells, and mazes whose ways are as narrow as their walls.

The lengths that belong to their questions are those of Dijkstra's algorithm over single cells, which shares nothing with the search that
they judge.
"""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import count
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tests.figures.map_questions import Question

KINDS: Final = {"dense-30": 0.30, "dense-36": 0.36, "dense-40": 0.40, "maze-1": None, "maze-braided": None}
"""Names of the maps that are drawn -> share of the cells that are blocked; two are mazes: one in which each two cells are joined by one way
only, and one in which every tenth wall has been taken out."""
_BRAIDED: Final = 0.1
_SQRT2: Final = 2.0**0.5
_STARTS: Final = 10
"""From which the questions of one map begin."""

_Mask = NDArray[np.bool_]


def drawn(kind: str, seed: int, size: int = 512) -> _Mask:
    """The passable cells of a map of `size` x `size`, by one of `KINDS`."""
    random = np.random.default_rng([seed, *kind.encode()])
    blocked = KINDS[kind]
    if blocked is not None:
        return random.random((size, size)) >= blocked
    return _maze(random, size, _BRAIDED if kind == "maze-braided" else 0.0)


def questions_on(free: _Mask, seed: int, many: int) -> list[Question]:
    """Questions between random cells that are joined, with the lengths of their shortest paths."""
    random = np.random.default_rng([seed, 512])
    found: list[Question] = []
    cells = np.argwhere(free)
    while len(found) < many:
        start = tuple(cells[random.integers(len(cells))].tolist())
        lengths = _lengths(free, start)
        joined = np.argwhere(np.isfinite(lengths))
        if len(joined) < len(cells) / 2:
            continue
        for row, column in joined[random.integers(len(joined), size=max(1, many // _STARTS))].tolist():
            found.append(Question(start, (row, column), float(lengths[row, column])))
    return found[:many]


def _maze(random: np.random.Generator, size: int, braided: float) -> _Mask:
    """Kruskal's maze: walls are taken out in random order where they part what is not joined yet, and a share of the others."""
    free = np.zeros((size, size), dtype=np.bool_)
    rooms = (size - 1) // 2
    free[1 : 2 * rooms : 2, 1 : 2 * rooms : 2] = True
    parent = list(range(rooms * rooms))

    def root(room: int) -> int:
        while parent[room] != room:
            parent[room] = parent[parent[room]]
            room = parent[room]
        return room

    walls = [(r, c, 0, 1) for r in range(rooms) for c in range(rooms - 1)]
    walls += [(r, c, 1, 0) for r in range(rooms - 1) for c in range(rooms)]
    for number in map(int, random.permutation(len(walls))):
        row, column, down, right = walls[number]
        one, other = root(row * rooms + column), root((row + down) * rooms + column + right)
        if one != other or random.random() < braided:
            parent[one] = other
            free[2 * row + 1 + down, 2 * column + 1 + right] = True
    return free


def _lengths(free: _Mask, start: tuple[int, int]) -> NDArray[np.float64]:
    """Of the shortest paths from one cell to all others, inf where there is none: by Dijkstra, cell by cell."""
    height, width = free.shape
    passable = np.pad(free, 1).ravel().tolist()
    stride = width + 2
    first = (start[0] + 1) * stride + start[1] + 1
    lengths = [float("inf")] * len(passable)
    lengths[first] = 0.0
    order = count()
    heap = [(0.0, next(order), first)]
    while heap:
        cost, _, cell = heappop(heap)
        if cost > lengths[cell]:
            continue
        for step, beside in ((1, stride), (-1, stride), (stride, 1), (-stride, 1)):
            if not passable[cell + step]:
                continue
            if cost + 1.0 < lengths[cell + step]:
                lengths[cell + step] = cost + 1.0
                heappush(heap, (cost + 1.0, next(order), cell + step))
            if beside == 1:
                continue
            for across in (stride, -stride):  # a step across needs both cells beside it
                there = cell + step + across
                if passable[cell + across] and passable[there] and cost + _SQRT2 < lengths[there]:
                    lengths[there] = cost + _SQRT2
                    heappush(heap, (cost + _SQRT2, next(order), there))
    return np.array(lengths).reshape(height + 2, stride)[1:-1, 1:-1]
