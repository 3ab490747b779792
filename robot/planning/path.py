"""Paths on the floor: points, lengths, and pulling a chain of cells straight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robot.geometry.angles import wrap
from robot.geometry.vectors import Floats

_SLACK = 0.01
"""By this share a straight line may cost more than the stretch it replaces; chosen: costs are sampled every half cell."""
_ROUNDING = 1e-9
"""And by this much, as sums of floats differ; points nearer to each other than this (m) are one."""
_AHEAD = 0.1
"""The direction of a path is that of so long a piece of it, m."""
_NO_LENGTH = 1e-12
"""What the square of a piece's length is divided by at least, m2: two points may coincide."""


@dataclass(frozen=True, eq=False)
class Path:
    """Points (n, 2) in metres from start to goal, joined by straight lines."""

    points: Floats

    def __post_init__(self) -> None:
        self.points.setflags(write=False)

    def __repr__(self) -> str:
        return f"Path({len(self.points)} points, {self.length:.2f} m)"

    @cached_property
    def arc(self) -> Floats:
        """Distance (m) along the path of every point, shape (n,)."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.arc[-1])

    def at(self, along: float) -> tuple[float, float]:
        """The point `along` metres from the start; before and beyond the ends, the ends."""
        return float(np.interp(along, self.arc, self.points[:, 0])), float(
            np.interp(along, self.arc, self.points[:, 1])
        )

    def project(self, x: float, y: float, low: float = 0.0, high: float = math.inf) -> tuple[float, float]:
        """(along, off): where on the stretch [low, high] (m) the path passes nearest to the point, and how near, m."""
        if len(self.points) == 1:
            return 0.0, math.hypot(x - self.points[0, 0], y - self.points[0, 1])
        first = max(int(np.searchsorted(self.arc, low, side="right")) - 1, 0)
        last = max(1, min(int(np.searchsorted(self.arc, high)), len(self.arc) - 1))
        first = min(first, last - 1)
        begin, end = self.points[first:last], self.points[first + 1 : last + 1]
        stretch = end - begin
        size = np.maximum((stretch * stretch).sum(axis=1), _NO_LENGTH)
        share = np.clip(((np.array([x, y]) - begin) * stretch).sum(axis=1) / size, 0.0, 1.0)
        foot = begin + share[:, None] * stretch
        off = np.hypot(foot[:, 0] - x, foot[:, 1] - y)
        best = int(off.argmin())
        along = float(self.arc[first + best] + share[best] * math.sqrt(size[best]))
        return min(max(along, low), min(high, self.length)), float(off[best])

    def tracking_error(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """How far a body is to the left of the path where that is nearest, m, and turned to the right of its direction there, rad."""
        along, off = self.project(x, y)
        begin, end = self.at(max(min(along, self.length - _AHEAD), 0.0)), self.at(along + _AHEAD)
        direction = math.atan2(end[1] - begin[1], end[0] - begin[0])
        left = math.cos(direction) * (y - begin[1]) - math.sin(direction) * (x - begin[0])
        return math.copysign(off, left), wrap(direction - yaw)

    def spaced(self, step: float) -> Path:
        """The same line with a point at least every `step` metres, and no two in one place, so that each piece has a direction."""
        count = max(math.ceil(self.length / step), 1)
        along = np.union1d(np.linspace(0.0, self.length, count + 1), self.arc)
        along = along[np.append(np.diff(along) > _ROUNDING, True)]
        return Path(np.column_stack([np.interp(along, self.arc, self.points[:, k]) for k in (0, 1)]))


def line_cells(begin: Sequence[float], end: Sequence[float]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the cells under a line between two cell middles, sampled every half cell. Both ends are
    included.
    """
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    share = np.linspace(0.0, 1.0, max(math.ceil(2.0 * length), 1) + 1)
    rows = np.rint(begin[0] + share * (end[0] - begin[0])).astype(np.intp)
    columns = np.rint(begin[1] + share * (end[1] - begin[1])).astype(np.intp)
    return rows, columns


def pull(cells: Sequence[tuple[int, int]], weights: Floats, slack: float = _SLACK) -> list[tuple[int, int]]:
    """Pull a chain of cells straight: drop every cell that the line between two others makes needless.

    A line replaces a stretch when every half cell of it is passable and it costs no more than the stretch (times 1 +
    slack). With weights of 1 and inf this is line-of-sight pulling; with inflated costs it keeps the distance that the
    costs asked for.
    """
    rows, columns = np.array(cells).T
    steps = np.hypot(np.diff(rows), np.diff(columns))
    price = weights[rows, columns]
    spent = np.concatenate([[0.0], np.cumsum(steps * (price[1:] + price[:-1]) / 2)])

    def worth(a: int, b: int) -> bool:
        along = weights[line_cells(cells[a], cells[b])]
        length = math.hypot(rows[b] - rows[a], columns[b] - columns[a])
        cost = length * float(along.mean())
        return cost <= float(spent[b] - spent[a]) * (1.0 + slack) + _ROUNDING

    kept, here, last = [0], 0, len(cells) - 1
    while here < last:
        # Longer and longer leaps while they are worth it, then shorter and shorter ones: a few dozen lines instead of hundreds.
        there, leap, growing = here + 1, 1, True
        while leap:
            if there + leap <= last and worth(here, there + leap):
                there += leap
                leap = leap * 2 if growing else leap // 2
            else:
                growing, leap = False, leap // 2
        kept.append(there)
        here = there
    return [cells[k] for k in kept]
