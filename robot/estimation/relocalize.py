"""Where on the map a scan may have been taken, when nothing else is known: every place and every heading is tried.

For each heading, the score of all places at once is the correlation of the map's likelihood field with the beams' ends, which the Fourier
transform gives for the price of one multiplication a cell (the field: Thrun, Burgard and Fox, 2005; the search over all poses: Olson, 2009).
The best places of all headings are then fitted to the map one by one, and judged by the beams, also by what they pass through.
Equations: docs/concepts/control.md#relocalization.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, pi, tau

import numpy as np
from numpy.typing import NDArray

from robot.estimation.scan_match import ScanMatcher
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns
from robot.planning.grid import Grid

CERTAIN = 0.08
"""A place is known when its score is higher than that of every other place by this; chosen: five of a hundred beams, and some."""

_CELL = 0.1
"""Of the grid of places, m: half of the width within which a beam's end counts as on a face."""
_TURN = tau / 120
"""Between two headings, 3 degrees: at 4 m the ends move by 0.2 m."""
_BLUR = 0.2
"""Standard deviation of a beam's end against the faces in the field of likelihoods, m: what cells and headings leave open."""
_TRACKED = 3
"""Steps of a fit by which a place is tracked from scan to scan; chosen: odometry carries it to within a centimetre meanwhile."""
_HYPOTHESES = 40
"""Places that are fitted."""
_APART, _APART_TURN = 0.5, 0.35
"""Two hypotheses nearer than this (m, rad) are one: a fit brings both to the same place."""
_FREE = 0.15
"""A beam that ends so far behind a mapped face has passed through it, m."""
_STEPS = 40
"""Points of a beam at which it is looked whether it passes through something."""


@dataclass(frozen=True, slots=True)
class Found:
    """A place where a scan fits."""

    pose: Pose2
    score: float
    """Share of the returning beams that end on mapped faces, less that of those that pass through some, -1..1."""


@dataclass(frozen=True, slots=True)
class Near:
    """A part of the map and of the headings: where somebody has said that the robot is."""

    pose: Pose2
    distance: float
    """From there, m."""
    turn: float
    """From that heading, rad."""


class Relocalizer:
    """Searches one map. A search takes about a tenth of a second of processor time for a hall of 12 x 10 m."""

    def __init__(self, grid: Grid, max_range: float = MAX_RANGE) -> None:
        self._matcher = ScanMatcher(grid, max_range)
        self._grid, self._max_range = grid, max_range
        self._coarse = grid.coarser(max(1, round(_CELL / grid.resolution)))
        likely = np.exp(-0.5 * (np.clip(self._coarse.clearance, -1.0, 4 * _BLUR) / _BLUR) ** 2)
        # Ends may lie a beam's length outside of every place. The transform wraps round: those on one side may meet those on the other, but not the map.
        reach = int(np.ceil(max_range / self._coarse.resolution))
        self._shape = self._coarse.height + reach, self._coarse.width + reach
        self._field = np.fft.rfft2(likely, self._shape)
        self._open = self._coarse.clearance > 0.0

    def __repr__(self) -> str:
        return f"Relocalizer({self._coarse!r})"

    def search(self, ranges: Floats, near: Near | None = None) -> list[Found]:
        """The places where a level scan of `ranges` (m) fits, best first, and far from each other; none if it has too few returns.

        With `near` only places that a fit reaches from there.
        """
        if not self._matcher.sees(ranges):
            return []
        valid = returns(ranges, self._max_range)
        angles, r = beam_angles(len(ranges))[valid], ranges[valid]
        return _distinct(
            Found(pose, self.score(pose, ranges))
            for pose, quality in (self._fit(start, ranges) for start in self._starts(r, angles, near))
            if quality > 0.0
        )

    def track(self, start: Pose2, ranges: Floats) -> Pose2:
        """The pose near `start` that fits a scan better, or `start` where it does not fit.

        For a place that was fitted to the scan before, too: a few steps, which the next scan goes on with.
        """
        return self._matcher.correct(start, ranges, _TRACKED)[0]

    def score(self, pose: Pose2, ranges: Floats) -> float:
        """How well a scan fits at `pose`: 1 if every beam ends on a mapped face and passes through none."""
        valid = returns(ranges, self._max_range)
        if not valid.any():
            return 0.0
        angles, r = beam_angles(len(ranges))[valid] + pose.yaw, ranges[valid]
        on_face = np.abs(self._clearance(pose.x + r * np.cos(angles), pose.y + r * np.sin(angles))) < _FREE
        along = np.linspace(0.0, 1.0, _STEPS, endpoint=False)[:, None] * np.maximum(r - 2 * _FREE, 0.0)
        inside = (
            self._clearance(pose.x + along * np.cos(angles), pose.y + along * np.sin(angles)) <= -self._grid.resolution
        )
        through = inside.any(axis=0)
        return float(on_face.mean() - through.mean())

    def _fit(self, start: Pose2, ranges: Floats) -> tuple[Pose2, float]:
        """Twice: the first fit may end outside of what the second one takes for the same place."""
        pose, quality = self._matcher.correct(start, ranges)
        return self._matcher.correct(pose, ranges) if quality > 0.0 else (pose, quality)

    def _starts(self, r: Floats, angles: Floats, near: Near | None) -> list[Pose2]:
        """The best places of all headings on the coarse grid, far from each other."""
        size, cell = (self._coarse.height, self._coarse.width), self._coarse.resolution
        best: list[tuple[float, Pose2]] = []
        allowed = self._open if near is None else self._open & self._within(near)
        most = min(_HYPOTHESES, int(allowed.sum()))
        if most == 0:
            return []
        for yaw in np.arange(-pi, pi - 0.5 * _TURN, _TURN).tolist():
            if near is not None and abs(wrap(yaw - near.pose.yaw)) > near.turn + _TURN:
                continue
            ends = np.zeros(self._shape)
            columns = np.rint(r * np.cos(angles + yaw) / cell).astype(np.intp) % self._shape[1]
            rows = np.rint(r * np.sin(angles + yaw) / cell).astype(np.intp) % self._shape[0]
            np.add.at(ends, (rows, columns), 1.0)
            scores = np.fft.irfft2(self._field * np.conj(np.fft.rfft2(ends)), self._shape)[: size[0], : size[1]]
            scores = np.where(allowed, scores, -1.0)
            for place in np.argpartition(scores, -most, axis=None)[-most:].tolist():
                row, column = divmod(place, size[1])
                best.append((float(scores[row, column]), Pose2(*self._coarse.middle(row, column), yaw)))
        best.sort(key=lambda one: -one[0])
        return [one.pose for one in _distinct((Found(pose, score) for score, pose in best), most=_HYPOTHESES)]

    def _within(self, near: Near) -> NDArray[np.bool_]:
        """Which places of the coarse grid are near enough, and at least the nearest ones."""
        rows, columns = np.indices((self._coarse.height, self._coarse.width))
        x, y = self._coarse.middle(0, 0)
        cell = self._coarse.resolution
        away = np.hypot(x + columns * cell - near.pose.x, y + rows * cell - near.pose.y)
        return np.asarray(away <= max(near.distance, cell))

    def _clearance(self, x: Floats, y: Floats) -> Floats:
        """Signed distance to the nearest face at the cell of each point, m; outside of the map there is a wall."""
        grid = self._grid
        columns = np.floor((x - grid.origin_x) / grid.resolution).astype(np.intp)
        rows = np.floor((y - grid.origin_y) / grid.resolution).astype(np.intp)
        column, row = np.clip(columns, 0, grid.width - 1), np.clip(rows, 0, grid.height - 1)
        beyond = np.maximum(np.abs(columns - column), np.abs(rows - row))
        return np.asarray(grid.clearance[row, column] - beyond * grid.resolution, dtype=np.float64)


def _distinct(found: Iterable[Found], most: int = 1_000) -> list[Found]:
    """Best first, without those that are near a better one."""
    kept: list[Found] = []
    for one in sorted(found, key=lambda each: -each.score):
        if all(apart(one.pose, other.pose) for other in kept):
            kept.append(one)
            if len(kept) == most:
                break
    return kept


def apart(one: Pose2, other: Pose2) -> bool:
    """Whether two places are not one that was found twice."""
    return hypot(one.x - other.x, one.y - other.y) > _APART or abs(wrap(one.yaw - other.yaw)) > _APART_TURN
