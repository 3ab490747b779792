"""Exact shortest octile paths on a grid: jump point search with tables that numpy fills once per map.

A step costs 1 along rows and columns and sqrt 2 across; a diagonal step needs both orthogonal neighbors free (no corner
cutting). This is the contract of the Moving AI benchmarks.

Sources: Harabor and Grastien, "Online Graph Pruning for Pathfinding on Grid Maps" (2011) and "Improving Jump Point
Search" (2014, JPS+), with the pruning rules of the variant without corner cutting: a straight move meets a forced
neighbor where a wall beside it has just ended, a diagonal move meets none.
"""

from __future__ import annotations

import heapq
import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from robot.planning.errors import GoalBlocked, StartBlocked, Unreachable
from robot.planning.grid import Cell
from tests.figures.landmarks import Landmarks, components

_SQRT2 = round(2.0**0.5 * 2**30) / 2**30
"""What a step across counts in the search: a multiple of 2^-30, so that sums are exact in any order, and ways of one length compare as equal. Two
lengths that differ are told apart as with the true root while their steps across differ by less than 27,000."""
_DIAGONAL_EXTRA = _SQRT2 - 1.0
_STEPS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
"""(rows, columns) of the eight directions in turning order; even ones are straight, odd ones diagonal."""

_LENGTHS = (1.0, _SQRT2) * 4
_LONGEST = 32_000
"""Cells a side, so that steps fit into 16 bits."""
_NEVER = 2**31
"""More steps than any map has."""

_Mask = NDArray[np.bool_]
_Steps = NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class GridPath:
    """A shortest path: its turning cells from start to goal, its exact octile cost, and how many nodes the search
    opened.
    """

    cells: tuple[Cell, ...]
    cost: float
    expanded: int


class OctileSearch:
    """Shortest paths on one map. Building it costs some 100 ns per cell; then a question is answered in low milliseconds.

    `free` has shape (height, width); True is passable. Everything outside is blocked. With `landmarks` it also finds out how far all cells
    are from a few of them: that costs as much as ten to a hundred questions, and mazes and dense fields are then answered in half to a third of the time.
    """

    def __init__(self, free: _Mask, *, landmarks: bool = False) -> None:
        self.height, self.width = (int(n) for n in free.shape)
        if max(self.height, self.width) > _LONGEST:
            raise ValueError(f"a map of {self.width} x {self.height} cells is too large: {_LONGEST} a side at most")
        # One blocked cell all round, so that no walk along the flat array can leave a row unnoticed.
        padded = np.pad(np.asarray(free, dtype=np.bool_), 1)
        self._stride = stride = self.width + 2
        self._free = padded.tobytes()
        self._offsets = tuple(rows * stride + columns for rows, columns in _STEPS)
        self._jumps = tuple(map(_as_array, _jump_tables(padded)))
        labels = components(padded)
        self._labels = labels.ravel()
        self._landmarks: Landmarks | None = None
        if landmarks and padded.any():
            self._landmarks = Landmarks(padded, labels, self._offsets, _LENGTHS, _moves(padded))

    def __repr__(self) -> str:
        return f"OctileSearch({self.width} x {self.height} cells)"

    def is_free(self, cell: Cell) -> bool:
        """Whether the cell is on the map and passable."""
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
        if self._labels[self._index(start)] != self._labels[self._index(goal)]:
            raise Unreachable(f"no passage joins cell {start} and cell {goal}")
        parents, expanded = self._search(self._index(start), self._index(goal))
        nodes = [self._index(goal)]
        while (node := parents[nodes[-1]]) >= 0:
            nodes.append(node)
        nodes.reverse()
        cells = tuple(_with_turns([(n // self._stride - 1, n % self._stride - 1) for n in nodes]))
        return GridPath(cells, _length(cells), expanded)

    def _search(self, start: int, goal: int) -> tuple[dict[int, int], int]:
        """A* over jump points between two cells that are joined. One long loop on purpose: calls and attribute look-ups would double its time.

        Nothing is forced where a diagonal move jumps to, so those cells are not queued: the walk across goes on past them, and what their
        straight parts find is queued as a successor of where it began (Harabor and Grastien's intermediate pruning).
        """
        stride, free, pop, push = self._stride, self._free, heapq.heappop, heapq.heappush
        straight = tuple(zip(self._jumps, self._offsets, range(8), strict=True))
        moves = tuple(
            (jumps, offset, _LENGTHS[d], (straight[d - 1], straight[(d + 1) % 8]) if d % 2 else ())
            for jumps, offset, d in straight
        )
        goal_row, goal_column = divmod(goal, stride)
        landmarks = self._landmarks.of(start, goal) if self._landmarks is not None else ()
        costs, parents, expanded = {start: 0.0}, {start: -1}, 0
        heap: list[tuple[float, float, int, int]] = [(0.0, 0.0, start, -1)]
        while True:
            _, negative, node, came = pop(heap)
            cost = -negative
            if cost > costs[node]:
                continue  # a better way here was found after this entry was queued
            if node == goal:
                return parents, expanded
            expanded += 1
            row, column = divmod(node, stride)
            steps_to_line, toward = _target(goal_row - row, goal_column - column)
            found: list[tuple[int, float, int]] = []
            for d in _next_directions(node, came, free, self._offsets):
                jumps, offset, length, aside = moves[d]
                here, gone, line = node, 0, steps_to_line if d == toward else _NEVER
                while True:
                    jump = jumps[here]
                    if line - gone <= (jump if jump > 0 else ~jump):
                        # the goal, or the cell from which it lies straight ahead
                        found.append((node + line * offset, cost + line * length, d))
                        break
                    if jump <= 0:
                        break
                    gone += jump
                    here += jump * offset
                    if not aside:
                        found.append((here, cost + gone, d))
                        break
                    for ahead, step, way in aside:
                        more = ahead[here]
                        if more > 0:
                            found.append((here + more * step, cost + gone * length + more, way))
            for there, new, d in found:
                known = costs.get(there)
                if known is None or new < known:
                    costs[there] = new
                    parents[there] = node
                    row, column = divmod(there, stride)
                    dx, dy = abs(goal_column - column), abs(goal_row - row)
                    rest = dx + dy * _DIAGONAL_EXTRA if dx > dy else dy + dx * _DIAGONAL_EXTRA
                    for distances, from_goal in landmarks:
                        least = abs(distances[there] - from_goal)
                        if least > rest:
                            rest = least
                    push(heap, (new + rest, -new, there, d))


def _length(cells: Sequence[Cell]) -> float:
    """Of a path of turning cells."""
    moves = [(abs(to[0] - at[0]), abs(to[1] - at[1])) for at, to in pairwise(cells)]
    across = sum(min(move) for move in moves)
    return sum(max(move) for move in moves) - across + across * math.sqrt(2.0)


def _with_turns(nodes: Sequence[Cell]) -> Iterator[Cell]:
    """The cells of a path with those added where a move turns from across to straight between two of them."""
    yield nodes[0]
    for (row, column), (to_row, to_column) in pairwise(nodes):
        down, right = to_row - row, to_column - column
        across = min(abs(down), abs(right))
        if 0 < across < max(abs(down), abs(right)):
            yield row + (across if down > 0 else -across), column + (across if right > 0 else -across)
        yield to_row, to_column


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


def _as_array(table: _Steps) -> array[int]:
    """The same numbers where plain Python reads one of them three times as fast."""
    values = array("h")
    values.frombytes(table.data.cast("B"))
    return values


# --- the tables ----------------------------------------------------------------------------------------------------


def _jump_tables(free: _Mask) -> list[_Steps]:
    """For each direction and cell: steps n to the next jump point as n, or steps n to the last free cell as -1 - n."""
    turned = np.ascontiguousarray(free.T)
    straight = {
        0: np.ascontiguousarray(_straight(turned, 1).T),
        2: _straight(free, 1),
        4: np.ascontiguousarray(_straight(turned, -1).T),
        6: _straight(free, -1),
    }
    finds = {d: table > 0 for d, table in straight.items()}
    return [
        straight[d] if d % 2 == 0 else _diagonal(free, finds[d - 1] | finds[(d + 1) % 8], down, right)
        for d, (down, right) in enumerate(_STEPS)
    ]


def _moves(free: _Mask) -> list[_Mask]:
    """For each direction, from which cells a step that way is possible; `free` has a blocked rim."""
    able: list[_Mask] = []
    for down, right in _STEPS:
        move = free & np.roll(free, (-down, -right), (0, 1))
        if down and right:
            move &= np.roll(free, -down, 0) & np.roll(free, -right, 1)
        able.append(move)
    return able


def _straight(free: _Mask, down: int) -> _Steps:
    """Jumps along columns: a cell is a jump point when a wall beside it has just ended."""
    here, back = (slice(1, None), slice(None, -1))[::down]
    ended = np.zeros_like(free)
    ended[here] = free[here] & ~free[back]
    points = np.zeros_like(free)
    points[:, :-1] |= ended[:, 1:]
    points[:, 1:] |= ended[:, :-1]
    return _sweep(free, points, down, 0)


def _diagonal(free: _Mask, finds: _Mask, down: int, right: int) -> _Steps:
    """Jumps across: to where a straight part of the move finds something. A step needs both orthogonal neighbors free."""
    enterable = free.copy()
    here, back = (slice(1, None), slice(None, -1))[::down]
    enterable[here] &= free[back]
    here, back = (slice(1, None), slice(None, -1))[::right]
    enterable[:, here] &= free[:, back]
    return _sweep(enterable, finds, down, right)


def _sweep(enterable: _Mask, points: _Mask, down: int, right: int) -> _Steps:
    """Count the steps for all cells, one row at a time, each from the row that the move leads to.

    A cell before a point counts 1, a cell before a wall -1; any other cell counts one more, away from zero, than the
    next.
    """
    height, width = enterable.shape
    begins = np.where(enterable, points, np.int8(-1))
    known = begins != 0
    steps: _Steps = np.full((height, width), -1, dtype=np.int16)
    to = slice(None, -1) if right > 0 else slice(1, None) if right < 0 else slice(None)
    at = slice(1, None) if right > 0 else slice(None, -1) if right < 0 else slice(None)
    for row in range(height - 2, -1, -1) if down > 0 else range(1, height):
        ahead, counted = steps[row + down, at], steps[row, to]
        np.right_shift(ahead, 15, out=counted)  # -1 below zero, else 0
        np.bitwise_or(counted, 1, out=counted)
        np.add(counted, ahead, out=counted)
        np.copyto(counted, begins[row + down, at], where=known[row + down, at])
    return steps
