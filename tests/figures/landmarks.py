"""What is worth knowing of a grid before its first question: which cells are joined at all, and how far each is from a few far corners.

Sources: Goldberg and Harrelson, "Computing the Shortest Path: A* Search Meets Graph Theory" (2005): by the triangle inequality, the difference of
two cells' distances from a landmark is at most the distance between them. Distances are found by Dial's buckets: as no move is shorter than
1, the cells of one bucket of width 1 cannot improve each other, and numpy settles a bucket at once.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats

_Mask = NDArray[np.bool_]
_Labels = NDArray[np.int64]

_USED = 2
"""Landmarks that one question looks at: those that know most of it; more cost more than they save."""


def components(free: _Mask) -> _Labels:
    """A number for each free cell, the same for cells that steps along rows and columns join; -1 for blocked ones.

    `free` must have a blocked rim.
    """
    flat = free.ravel()
    begins = flat.copy()
    begins[1:] &= ~flat[:-1]
    runs = np.where(free, np.cumsum(begins).reshape(free.shape) - 1, -1)
    joined = free[1:] & free[:-1]
    above, below = runs[:-1][joined], runs[1:][joined]
    parent = np.arange(max(1, int(begins.sum())))
    while True:
        roots = parent[above], parent[below]
        low, high = np.minimum(*roots), np.maximum(*roots)
        apart = low < high
        if not apart.any():
            break
        np.minimum.at(parent, high[apart], low[apart])
        while not np.array_equal(shorter := parent[parent], parent):
            parent = shorter
    return np.where(free, parent[runs], -1)


class Landmarks:
    """Distances of all cells of the largest component from its cells nearest to the four corners of the map.

    Cells are those of the flattened map with a blocked rim; `offsets` and `lengths` are those of the eight moves.
    """

    __slots__ = ("_tables",)

    def __init__(
        self, free: _Mask, labels: _Labels, offsets: Sequence[int], lengths: Sequence[float], moves: Sequence[_Mask]
    ) -> None:
        places = _corners(labels)
        tables = _distances(free.size, places, offsets, lengths, moves)
        self._tables = tuple(array("d", table.tobytes()) for table in tables)

    def of(self, start: int, goal: int) -> tuple[tuple[array[float], float], ...]:
        """The tables that know most of a question, each with the goal's entry; none where start and goal lie elsewhere."""
        known = [(abs(table[goal] - table[start]), table, table[goal]) for table in self._tables]
        known = [row for row in known if 0.0 < row[0] < float("inf")]
        known.sort(key=lambda row: row[0], reverse=True)
        return tuple((table, there) for _, table, there in known[:_USED])


def _corners(labels: _Labels) -> list[int]:
    """The cells of the largest component that lie farthest along the four diagonals."""
    largest = int(np.bincount(labels[labels >= 0]).argmax())
    rows, columns = np.nonzero(labels == largest)
    cells = rows * labels.shape[1] + columns
    ends = (rows + columns, rows - columns)
    return sorted({int(cells[pick(end)]) for end in ends for pick in (np.argmin, np.argmax)})


def _distances(
    size: int, places: Sequence[int], offsets: Sequence[int], lengths: Sequence[float], moves: Sequence[_Mask]
) -> Floats:
    """Exact distances of all cells from each place, shape (places, size), inf where there is no way; all places at once."""
    distance = np.full(len(places) * size, np.inf)
    waiting = np.arange(len(places)) * size + np.asarray(places)
    distance[waiting] = 0.0
    open_ = [np.tile(move.ravel(), len(places)) for move in moves]
    queued = np.zeros(distance.size, dtype=np.bool_)
    while waiting.size:
        costs = distance[waiting]
        now = costs < np.floor(costs.min()) + 1.0
        front, cost, later = waiting[now], costs[now], waiting[~now]
        queued[later] = True
        found = [later]
        for move, offset, length in zip(open_, offsets, lengths, strict=True):
            able = move[front]
            cells, new = front[able] + offset, cost[able] + length
            better = new < distance[cells]
            cells = cells[better]
            distance[cells] = new[better]
            cells = cells[~queued[cells]]
            queued[cells] = True
            found.append(cells)
        waiting = np.concatenate(found)
        queued[waiting] = False
    return distance.reshape(len(places), size)
