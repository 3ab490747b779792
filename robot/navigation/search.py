"""Exact shortest octile paths on a grid: jump point search with tables that numpy fills once per map.

A step costs 1 along rows and columns and sqrt 2 across; a diagonal step needs both orthogonal neighbors free (no corner
cutting). This is the contract of the Moving AI benchmarks.

Sources: Harabor and Grastien, "Online Graph Pruning for Pathfinding on Grid Maps" (2011) and "Improving Jump Point
Search" (2014, JPS+), with the pruning rules of the variant without corner cutting: a straight move meets a forced
neighbor where a wall beside it has just ended, a diagonal move meets none.
"""

from __future__ import annotations

import heapq
from array import array
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot.navigation.errors import GoalBlocked, StartBlocked, Unreachable

__all__ = ["Cell", "GridPath", "OctileSearch"]

Cell = tuple[int, int]
"""(row, column)."""

_SQRT2 = 2.0**0.5
_STEPS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
"""(rows, columns) of the eight directions in turning order; even ones are straight, odd ones diagonal."""

_Mask = NDArray[np.bool_]
_Indices = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class GridPath:
    """A shortest path: its turning cells from start to goal, its exact octile cost, and how many nodes the search
    opened.
    """

    cells: tuple[Cell, ...]
    cost: float
    expanded: int


class OctileSearch:
    """Shortest paths on one map. Building it costs about 0.1 us per cell; then each question is answered in low
    milliseconds.

    `free` has shape (height, width); True is passable. Everything outside is blocked.
    """

    def __init__(self, free: _Mask) -> None:
        self.height, self.width = (int(n) for n in free.shape)
        # One blocked cell all round, so that no walk along the flat array can leave a row unnoticed.
        padded = np.pad(np.asarray(free, dtype=np.bool_), 1)
        self._stride = stride = self.width + 2
        flat = padded.reshape(-1)
        self._free = flat.tobytes()
        self._offsets = tuple(rows * stride + columns for rows, columns in _STEPS)
        straight = {d: _straight_jumps(flat, self._offsets[d], stride if d in (0, 4) else 1) for d in (0, 2, 4, 6)}
        jumps = [
            straight[d]
            if d % 2 == 0
            else _diagonal_jumps(flat, self._offsets, d, straight[d - 1] > 0, straight[(d + 1) % 8] > 0)
            for d in range(8)
        ]
        self._jumps = tuple(array("i", table.tobytes()) for table in jumps)

    def __repr__(self) -> str:
        return f"OctileSearch({self.width} x {self.height} cells)"

    def is_free(self, cell: Cell) -> bool:
        row, column = cell
        return 0 <= row < self.height and 0 <= column < self.width and bool(self._free[self._index(cell)])

    def _index(self, cell: Cell) -> int:
        return (cell[0] + 1) * self._stride + cell[1] + 1

    def solve(self, start: Cell, goal: Cell) -> GridPath:
        """A shortest path. Raises `StartBlocked`, `GoalBlocked` or `Unreachable`."""
        if not self.is_free(start):
            raise StartBlocked(f"no path can start at cell {start}: it is blocked or outside of the map")
        if not self.is_free(goal):
            raise GoalBlocked(f"no path can end at cell {goal}: it is blocked or outside of the map")
        if start == goal:
            return GridPath((start,), 0.0, 0)
        parents, cost, expanded = self._search(self._index(start), self._index(goal))
        if cost is None:
            raise Unreachable(f"no passage joins cell {start} and cell {goal}: {expanded} jump points were searched")
        nodes = [self._index(goal)]
        while (node := parents[nodes[-1]]) >= 0:
            nodes.append(node)
        cells = tuple((n // self._stride - 1, n % self._stride - 1) for n in reversed(nodes))
        return GridPath(cells, cost, expanded)

    def _search(self, start: int, goal: int) -> tuple[dict[int, int], float | None, int]:
        """A* over jump points. One long loop on purpose: calls and attribute look-ups would double its time."""
        stride, free, offsets, jumps = self._stride, self._free, self._offsets, self._jumps
        goal_row, goal_column = divmod(goal, stride)
        costs = {start: 0.0}
        parents = {start: -1}
        heap: list[tuple[float, float, int, int]] = [(0.0, 0.0, start, -1)]
        pop, push, diagonal_extra = heapq.heappop, heapq.heappush, _SQRT2 - 1.0
        expanded = 0
        while heap:
            _, negative, node, came = pop(heap)
            cost = -negative
            if cost > costs[node]:
                continue  # a better way here was found after this entry was queued
            if node == goal:
                return parents, cost, expanded
            expanded += 1
            row, column = divmod(node, stride)
            down, right = goal_row - row, goal_column - column
            steps_to_line, toward = _target(down, right)
            for d in _next_directions(node, came, free, offsets):
                jump = jumps[d][node]
                reach = jump if jump > 0 else -jump
                if d == toward and steps_to_line <= reach:
                    jump = steps_to_line  # the goal, or the cell from which it lies straight ahead
                if jump <= 0:
                    continue
                there = node + jump * offsets[d]
                new = cost + (jump * _SQRT2 if d & 1 else jump)
                known = costs.get(there)
                if known is None or new < known:
                    costs[there] = new
                    parents[there] = node
                    there_row, there_column = divmod(there, stride)
                    dx, dy = abs(goal_column - there_column), abs(goal_row - there_row)
                    rest = dx + dy * diagonal_extra if dx > dy else dy + dx * diagonal_extra
                    push(heap, (new + rest, -new, there, d))
        return parents, None, expanded


def _target(down: int, right: int) -> tuple[int, int]:
    """How many steps, and in which direction, until the goal is reached or lies on a straight line ahead."""
    if down == 0:
        return abs(right), 0 if right > 0 else 4
    if right == 0:
        return abs(down), 2 if down > 0 else 6
    steps = min(abs(down), abs(right))
    if down > 0:
        return steps, 1 if right > 0 else 3
    return steps, 7 if right > 0 else 5


_ALL = tuple(range(8))
_AFTER_DIAGONAL = tuple(((d - 1) % 8, d, (d + 1) % 8) if d % 2 else () for d in range(8))
_STRAIGHT_ON = tuple((d,) for d in range(8))
_LEFT = tuple((d, (d + 1) % 8, (d + 2) % 8) for d in range(8))
_RIGHT = tuple((d, (d - 1) % 8, (d - 2) % 8) for d in range(8))
_BOTH = tuple((*_LEFT[d], *_RIGHT[d][1:]) for d in range(8))


def _next_directions(node: int, came: int, free: bytes, offsets: tuple[int, ...]) -> tuple[int, ...]:
    """The directions that pruning leaves for a node reached by moving in direction `came` (-1: the start)."""
    if came < 0:
        return _ALL
    if came & 1:
        return _AFTER_DIAGONAL[came]
    left, back = offsets[(came + 2) % 8], node - offsets[came]
    open_left = free[node + left] and not free[back + left]
    open_right = free[node - left] and not free[back - left]
    if open_left:
        return _BOTH[came] if open_right else _LEFT[came]
    return _RIGHT[came] if open_right else _STRAIGHT_ON[came]


def _shifted(flat: _Mask, offset: int) -> _Mask:
    """flat[i + offset] at place i. What wraps around only reaches the blocked border, where it does not matter."""
    return np.roll(flat, -offset)


def _straight_jumps(free: _Mask, offset: int, side: int) -> _Indices:
    """Per cell: steps to the next jump point (positive), or minus the steps until the wall."""
    forced = np.zeros_like(free)
    for beside in (side, -side):
        forced |= _shifted(free, beside) & ~_shifted(free, beside - offset)
    return _jumps(free, forced & free, offset)


def _diagonal_jumps(free: _Mask, offsets: tuple[int, ...], d: int, before: _Mask, after: _Mask) -> _Indices:
    """As `_straight_jumps`; a diagonal move stops where one of its two straight components would find a jump point."""
    enterable = free & _shifted(free, -offsets[d - 1]) & _shifted(free, -offsets[(d + 1) % 8])
    return _jumps(enterable, enterable & (before | after), offsets[d])


def _jumps(enterable: _Mask, points: _Mask, offset: int) -> _Indices:
    """Steps along `offset` to the next point, or minus the steps to the last enterable cell; for all cells at once.

    Cells that lie `offset` apart form the columns of an array `abs(offset)` wide, so one running minimum (or maximum)
    per column finds the next stop of every cell.
    """
    size, step = enterable.size, abs(offset)
    places = np.arange(size, dtype=np.int32)
    forward = offset > 0
    nowhere = np.int32(size - 1 if forward else 0)
    stops = np.where(points | ~enterable, places, nowhere)
    missing = -size % step
    table = np.concatenate([stops, np.full(missing, nowhere, np.int32)]) if missing else stops
    columns = table.reshape(-1, step)
    if forward:
        ahead = np.minimum.accumulate(columns[::-1], axis=0)[::-1].reshape(-1)[:size]
    else:
        ahead = np.maximum.accumulate(columns, axis=0).reshape(-1)[:size]
    following = np.roll(ahead, -offset)
    steps = (following - places) // offset
    return np.asarray(np.where(points[following], steps, 1 - steps), dtype=np.int32)
