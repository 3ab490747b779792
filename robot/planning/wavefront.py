"""Cheapest paths over weighted cells, exact, in numpy: Dijkstra's wave, one whole front at a time.

All nodes whose cost lies within one smallest edge of the cheapest open node are final together (no edge between them can be
shorter), so each round settles a front of them with a dozen array operations instead of one node with a heap operation
(Dial's buckets; Crauser et al., "A Parallelization of Dijkstra's Shortest Path Algorithm", 1998, OUT criterion with a constant).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.planning.grid import Cell

Nodes = NDArray[np.intp]

_SQRT2 = 2.0**0.5


def spread(
    edges: Floats, beside: Callable[[Nodes], Nodes], source: int, targets: NDArray[np.bool_], smallest: float
) -> tuple[int | None, Floats, Nodes]:
    """Spread from one node until the cheapest target is settled.

    `edges` holds the cost of every node's edges, shape (nodes, m), inf for none, none below `smallest`; `beside` gives the nodes at
    their ends, shape (n, m). Returns the target reached (None when none can be), the costs, and where each node was reached from.
    """
    costs = np.full(len(edges), np.inf)
    origin = np.full(len(edges), -1, dtype=np.intp)
    order = np.zeros(len(edges), dtype=np.intp)
    waiting = np.zeros(len(edges), dtype=np.bool_)
    costs[source] = 0.0
    front = np.array([source], dtype=np.intp)
    while front.size:
        reached = costs[front]
        settled = reached < reached.min() + smallest
        now = front[settled]
        found = now[targets[now]]
        if found.size:
            return int(found[costs[found].argmin()]), costs, origin
        waiting[now] = False
        asked = reached[settled][:, None] + edges[now]
        near = beside(now)
        better = asked < costs[near]
        neighbors, offered = near[better], asked[better]
        np.minimum.at(costs, neighbors, offered)
        won = costs[neighbors] == offered
        origin[neighbors[won]] = np.broadcast_to(now[:, None], near.shape)[better][won]
        # Each fresh node once: of equal ones only that stays whose rank was written last.
        fresh = neighbors[~waiting[neighbors]]
        waiting[fresh] = True
        ranks = np.arange(fresh.size)
        order[fresh] = ranks
        front = np.concatenate([front[~settled], fresh[order[fresh] == ranks]])
    return None, costs, origin


class Wavefront:
    """Cheapest paths on one weighted grid: a step costs its length (cells) times the mean weight of the two cells.

    `weights` has shape (height, width); every weight is at least 1, inf is impassable. Diagonal steps need both orthogonal
    neighbors passable.
    """

    def __init__(self, weights: Floats) -> None:
        self._stride = stride = weights.shape[1] + 2
        flat = np.pad(weights, 1, constant_values=np.inf).reshape(-1)
        self._offsets = np.array(
            [1, stride, -1, -stride, stride + 1, stride - 1, -stride - 1, 1 - stride], dtype=np.intp
        )
        ahead = [np.roll(flat, -o) for o in self._offsets]
        edges = np.empty((flat.size, 8))
        for d in range(4):
            edges[:, d] = (flat + ahead[d]) * 0.5
        for d, (a, b) in enumerate(((0, 1), (1, 2), (2, 3), (3, 0)), start=4):
            corner = np.maximum(ahead[a], ahead[b])
            edges[:, d] = np.where(np.isinf(corner), np.inf, (flat + ahead[d]) * (_SQRT2 / 2))
        self._edges = edges

    def path(self, start: Cell, goal: Cell) -> tuple[list[Cell], float] | None:
        """Cells from start to goal, and the cost in cells; None when nothing joins them."""
        begin, end = ((cell[0] + 1) * self._stride + cell[1] + 1 for cell in (start, goal))
        targets = np.zeros(len(self._edges), dtype=np.bool_)
        targets[begin] = True
        reached, costs, toward = spread(self._edges, lambda now: now[:, None] + self._offsets, end, targets, 1.0)
        if reached is None:
            return None
        nodes = [begin]
        while nodes[-1] != end:
            nodes.append(int(toward[nodes[-1]]))
        return [(n // self._stride - 1, n % self._stride - 1) for n in nodes], float(costs[begin])
