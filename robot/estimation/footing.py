"""Where the robot may tread, on its map: what an elevation map has shown of steps, holes and things that hang low."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robot.estimation.elevation import CROSSABLE, FREE, HIDDEN, LOW, UNSEEN, UPRIGHT, WALL, Relief
from robot.estimation.movers import Mover
from robot.geometry.planar import Pose2, seen_from
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.planning.grid import Grid, distance_to

_EXPLAINED = 0.15
"""What is seen so near to a mapped face is that face, m; chosen: three cells of the elevation map, for a pose that is a little wrong."""
_BESIDE = 0.3
"""So near to a slope that the map shows the ground is taken for a part of it, m; chosen: six cells, for a pose that is a little wrong."""
_TRAIL = 0.3
"""Around a thing that moves, and so far behind it in time (s) and distance (m), the elevation map lags behind."""


class Footing:
    """Steps, walls and unseen floor in the cells of a map. What lies outside of the latest relief stays as it was seen last."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        shape = (grid.height, grid.width)
        self._cells: NDArray[np.int8] = np.full(shape, UNSEEN, dtype=np.int8)
        self._slopes = _near_slopes(grid)
        self.known = False
        """Whether there has been any relief: without one nothing is unseen, as nobody looks."""

    def __repr__(self) -> str:
        return f"Footing({int((self._cells == WALL).sum())} walls, {int((self._cells == LOW).sum())} low steps)"

    @property
    def walls(self) -> NDArray[np.bool_]:
        """Cells that cannot be trodden on, shape of the map."""
        return np.asarray(self._cells == WALL)

    @property
    def steps(self) -> NDArray[np.bool_]:
        """Cells of steps that can be crossed slowly, shape of the map."""
        return np.asarray(self._cells == LOW)

    def forget(self) -> None:
        """Start over."""
        self._cells.fill(UNSEEN)

    def integrate(
        self, relief: Relief, pose: Pose2, footprint: Footprint, movers: Sequence[Mover], *, scanned: bool
    ) -> bool:
        """Take in what is seen from `pose`, but the body itself, what the map explains, and what moves; True if walls or steps changed.

        `scanned` says that the LiDAR shows what stands in its plane: then that is left to it.
        """
        grid = self._grid
        x: Floats = grid.origin_x + (np.arange(grid.width, dtype=np.float64) + 0.5) * grid.resolution
        y: Floats = grid.origin_y + (np.arange(grid.height, dtype=np.float64) + 0.5) * grid.resolution
        columns = np.floor((x - relief.origin_x) / relief.resolution).astype(np.intp)
        rows = np.floor((y - relief.origin_y) / relief.resolution).astype(np.intp)
        inside = [
            np.flatnonzero((at >= 0) & (at < n)) for at, n in zip((rows, columns), relief.cells.shape, strict=True)
        ]
        if not (len(inside[0]) and len(inside[1])):
            return False
        self.known = True
        part = slice(inside[0][0], inside[0][-1] + 1), slice(inside[1][0], inside[1][-1] + 1)
        seen = relief.cells[np.ix_(rows[part[0]], columns[part[1]])]
        at_x, at_y = x[None, part[1]], y[part[0], None]
        harmless = (grid.clearance[part] <= _EXPLAINED) | _within(footprint, pose, at_x, at_y)
        for mover in movers:
            lag_x, lag_y = mover.x - _TRAIL * mover.vx - at_x, mover.y - _TRAIL * mover.vy - at_y
            harmless |= np.hypot(lag_x, lag_y) < mover.radius + _TRAIL
        seen = np.where(seen == UPRIGHT, FREE if scanned else WALL, seen)
        slopes = self._slopes[part]
        seen = np.where(seen == HIDDEN, np.where(slopes | self._lower(pose)[part], UNSEEN, WALL), seen)
        seen = np.where(slopes & (seen == LOW), FREE, seen)
        new = np.where(harmless & (seen > FREE), FREE, seen)
        old = self._cells[part]
        new = np.where(new == UNSEEN, np.where(old > FREE, old, UNSEEN), new)
        changed = bool(((new > FREE) | (old > FREE)).any()) and not np.array_equal(
            np.maximum(new, 0), np.maximum(old, 0)
        )
        self._cells[part] = new
        return changed

    def seen_along(self, points: Floats) -> float:
        """How far the floor is seen along points (n, 2) of a path, m; inf as far as they go. A cell counts as seen when one beside it is."""
        if not self.known or len(points) < 2:
            return math.inf
        grid = self._grid
        columns = np.clip(((points[:, 0] - grid.origin_x) / grid.resolution).astype(np.intp), 1, grid.width - 2)
        rows = np.clip(((points[:, 1] - grid.origin_y) / grid.resolution).astype(np.intp), 1, grid.height - 2)
        around = [self._cells[rows + up, columns + right] for up in (-1, 0, 1) for right in (-1, 0, 1)]
        unseen = np.flatnonzero(np.max(around, axis=0) == UNSEEN)
        if not len(unseen):
            return math.inf
        return float(np.hypot(*np.diff(points[: unseen[0] + 1], axis=0).T).sum())

    def steps_within(self, pose: Pose2, radius: float) -> bool:
        """Whether there is a step within `radius` m."""
        return bool((self._cells[self._around(pose, radius)] == LOW).any())

    def slopes_within(self, pose: Pose2, radius: float) -> bool:
        """Whether the map shows a slope within `radius` m, or up to 30 cm farther away."""
        return self._grid.ground is not None and bool(self._slopes[self._around(pose, radius)].any())

    def _lower(self, pose: Pose2) -> NDArray[np.bool_]:
        """Where the map shows ground that lies deeper than what the robot stands on: hidden floor there is no hole."""
        ground, here = self._grid.ground, self._grid.cell(pose.x, pose.y)
        if ground is None or here is None:
            return np.zeros_like(self._slopes)
        return np.asarray(ground < ground[here] - CROSSABLE)

    def _around(self, pose: Pose2, radius: float) -> tuple[slice, slice]:
        """The cells of a square about a pose."""
        grid = self._grid
        reach = math.ceil(radius / grid.resolution)
        column = math.floor((pose.x - grid.origin_x) / grid.resolution)
        row = math.floor((pose.y - grid.origin_y) / grid.resolution)
        return (
            slice(max(row - reach, 0), max(row + reach + 1, 0)),
            slice(max(column - reach, 0), max(column + reach + 1, 0)),
        )


def _near_slopes(grid: Grid) -> NDArray[np.bool_]:
    """Cells on a slope that the map shows, or beside one. There floor that is hidden behind a crest is no hole, and the crest is no step."""
    if grid.ground is None:
        return np.zeros((grid.height, grid.width), dtype=np.bool_)
    gradients: Floats = np.array(np.gradient(grid.ground), dtype=np.float64)
    sloping = np.hypot(gradients[0], gradients[1]) > 0.0
    return np.asarray(distance_to(sloping, grid.resolution, _BESIDE) < _BESIDE)


def _within(footprint: Footprint, pose: Pose2, x: Floats, y: Floats) -> NDArray[np.bool_]:
    return np.asarray(footprint.distances(*seen_from(pose, x, y)) <= 0.0)
