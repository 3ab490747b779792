"""Fields of posts drawn from a seed, in the manner of BARN: worlds that nothing in the robot was chosen on.

A field fills a corridor between start and goal. Its cells are drawn at random, then smoothed by a cellular automaton, as in Perille, Truong, Xiao
and Stone, "Benchmarking Metric Ground Navigation" (2020); the same seed gives the same world. A field is kept when its widest way through is
between the two widths of `PASSAGE`: narrow enough for clearances to matter, wide enough for the body.
"""

from __future__ import annotations

from itertools import count
from math import pi

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2
from robot.planning.errors import Unreachable
from robot.planning.grid import distance_to
from robot.scenes.scene import Cylinder, Scene
from tests.figures.barn_worlds import BarnWorld
from tests.figures.jump_points import OctileSearch

PASSAGE = (0.62, 0.90)
"""Widths between which the narrowest place of the widest way through a field lies, m; chosen: the body is 0.5 m wide, BARN's narrowest is 0.74."""
_CELL = 0.15
"""m: a post fills one."""
_COLUMNS, _ROWS = 30, 33
_ROWS_BEFORE, _ROWS_BEHIND = 16, 14
"""Of open corridor before and behind the field."""
_SHARES = (0.15, 0.20, 0.25, 0.30)
"""Of the cells that are filled at first."""
_ROUNDS = (2, 3, 4)
"""Of smoothing."""
_FILLS, _CLEARS = 5, 1
"""A cell with at least so many filled neighbors is filled, one with at most so many is cleared."""
_FINE = 3
"""Cells of 5 cm to each of the field's, to measure passages with."""
_HEIGHT = 1.5
"""Of the posts, m: taller than the robot."""
_MARGIN = 4.0
"""Open floor round everything, m."""
_FROM_END = 8
"""Rows from the corridor's ends to start and goal."""
_GOAL_RADIUS = 1.0
"""m, as in BARN."""

_Mask = NDArray[np.bool_]


def field_world(seed: int) -> BarnWorld:
    """The world of this seed; its index is the seed."""
    for attempt in count():
        filled = _walled(_field(np.random.default_rng([seed, attempt])))
        length = _way(filled, PASSAGE[0])
        if length is not None and _way(filled, PASSAGE[1]) is None:
            return _world(seed, filled, length)
    raise AssertionError("count() does not end")


def _field(random: np.random.Generator) -> _Mask:
    """Cells that hold a post, shape (rows, columns), row 0 nearest to the start."""
    share, rounds = random.choice(_SHARES), int(random.choice(_ROUNDS))
    filled: _Mask = random.random((_ROWS, _COLUMNS)) < share
    for _ in range(rounds):
        padded = np.pad(filled.astype(np.int8), 1)
        around = sum(
            padded[1 + down : 1 + down + _ROWS, 1 + right : 1 + right + _COLUMNS]
            for down in (-1, 0, 1)
            for right in (-1, 0, 1)
            if down or right
        )
        filled = (filled | (around >= _FILLS)) & (around > _CLEARS)
    return filled


def _walled(field: _Mask) -> _Mask:
    """The field in its corridor: walls at both sides and behind the start."""
    filled: _Mask = np.zeros((_ROWS_BEFORE + _ROWS + _ROWS_BEHIND, _COLUMNS), dtype=np.bool_)
    filled[_ROWS_BEFORE : _ROWS_BEFORE + _ROWS] = field
    filled[: _ROWS_BEFORE + _ROWS, [0, -1]] = True
    filled[0] = True
    return filled


def _ends(filled: _Mask) -> tuple[tuple[int, int], tuple[int, int]]:
    """Cells of start and goal, (row, column)."""
    return (_FROM_END, _COLUMNS // 2), (len(filled) - _FROM_END, _COLUMNS // 2)


def _way(filled: _Mask, width: float) -> float | None:
    """Length (m) of the shortest way for the middle of a disc `width` m across, on a grid of 5 cm; None when there is none."""
    fine = np.kron(filled, np.ones((_FINE, _FINE), dtype=np.bool_))
    clearance = distance_to(fine, _CELL / _FINE, width)
    start, goal = ((row * _FINE + 1, column * _FINE + 1) for row, column in _ends(filled))
    try:
        return OctileSearch(clearance >= width / 2).solve(start, goal).cost * _CELL / _FINE
    except Unreachable:
        return None


def _world(seed: int, filled: _Mask, length: float) -> BarnWorld:
    rows, columns = (cells.tolist() for cells in np.nonzero(filled))
    posts = tuple(Cylinder(*_middle(*cell), _CELL / 2, _HEIGHT) for cell in zip(rows, columns, strict=True))
    begin, end = (_middle(*cell) for cell in _ends(filled))
    far_x, far_y = _middle(*filled.shape)
    start = Pose2(*begin, pi / 2)
    scene = Scene(f"field {seed}", (-_MARGIN, -_MARGIN, far_x + _MARGIN, far_y + _MARGIN), posts, start, start)
    return BarnWorld(seed, scene, Pose2(*end), _GOAL_RADIUS, length)


def _middle(row: int, column: int) -> tuple[float, float]:
    """x and y of a cell's middle, m."""
    return (column + 0.5) * _CELL, (row + 0.5) * _CELL
