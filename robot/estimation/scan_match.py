"""Where a scan says the robot is: Gauss-Newton on the map's distance field.

Every beam's end should lie on an obstacle, so the clearance D there is the residual (the likelihood field of Thrun, Burgard and Fox,
"Probabilistic Robotics", 2005). Minimised over the pose x, with the ends ej of the returning beams and the prior x0:

    sum c^2 ln(1 + D(x ej)^2 / c^2)  +  (x - x0)' diag((_SIGMA / _PRIOR)^2) (x - x0)

as a reweighted least-squares problem, weights 1 / (1 + D^2 / c^2): beams that hit what the map does not know hardly count. It assumes
a static map and a prior within some 30 cm and 10 degrees. A LiDAR whose ranges are all too long by one length has that as a fourth unknown,
with the estimate of the scans before as its prior. Steps and sources: docs/concepts/control.md#localization.
"""

from __future__ import annotations

import math

import numpy as np

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, turned
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns
from robot.planning.grid import Grid

ACCEPTED = 0.6
"""A quality below this means: the scan did not fit, and the prior came back unchanged."""

_ROUNDS = 15
"""Gauss-Newton steps at most."""
_FIT = 0.08
"""A beam that ends this near to a mapped face fits it, m: four sigma of the worst LiDAR (2 cm)."""
_FEWEST = 30
"""Beams with a return; fewer say too little."""
_FARTHEST, _MOST_TURN = 0.5, 0.35
"""A correction beyond this (m, rad) is a mistake, not a correction."""
_WIDE, _NARROW = 0.15, 0.05
"""Scales of the Cauchy weight, m: first as wide as a usual prior is wrong, then two and a half sigma of the worst LiDAR; chosen."""
_SETTLED = 1e-3
"""A step below this in every part (m, rad) ends the search at one scale; chosen: a twentieth of the LiDAR's sigma."""
_OUTSIDE = (-4.0, 5.0)
"""So far beyond a cell its slope goes on, in cells: 20 cm behind the map's edge; chosen."""
_SIGMA = 0.02
"""Standard deviation of a beam, m."""
_PRIOR = np.array([0.3, 0.3, 0.2])
"""Standard deviations of the prior, m, m, rad: it counts for next to nothing against walls, but is all there is along a corridor."""


_LEARN = 0.1
"""Share of a scan's range bias that is believed at once; chosen: a second's worth of scans makes two thirds."""


class ScanMatcher:
    """Corrects poses on one map. About 1 ms per scan of 360 beams.

    `bias_sd` (m) is how far ranges may be wrong altogether, one sigma; 0: not at all, and `bias` stays 0.
    """

    def __init__(self, grid: Grid, max_range: float = MAX_RANGE, bias_sd: float = 0.0) -> None:
        self.max_range = max_range
        self.bias = 0.0
        """By which all ranges are too long, as far as scans have shown, m."""
        self._bias_sd = bias_sd
        self._resolution = grid.resolution
        self._origin = grid.middle(0, 0)
        # Beyond 2 m the field is flat: a beam that far from everything has no say, and inf would spoil the sums.
        self._field = np.clip(grid.clearance, -2.0, 2.0)
        self._useful = min(grid.width, grid.height) >= 2 and bool(grid.occupied.any())

    def __repr__(self) -> str:
        rows, columns = self._field.shape
        return f"ScanMatcher({columns} x {rows} cells of {self._resolution:g} m)"

    def correct(self, prior: Pose2, ranges: Floats, rounds: int = _ROUNDS) -> tuple[Pose2, float]:
        """The pose that fits the scan best, and its quality: the share of the returning beams that end on mapped faces,
        0..1.

        `ranges` (m): beam i looks along yaw - pi + i 2 pi / n; the maximum range, NaN and inf mean no return. A quality
        below `ACCEPTED` means that the scan does not fit (too few returns, an unmapped place, a correction over 0.5 m
        or 20 degrees); the prior is then returned as it came. `rounds` is how many steps the search takes at most.
        """
        valid = returns(ranges, self.max_range)
        if not self._useful or int(valid.sum()) < _FEWEST:
            return prior, 0.0
        angles, r = beam_angles(len(ranges))[valid], ranges[valid]
        start = [prior.x, prior.y, prior.yaw, *([self.bias] if self._bias_sd > 0.0 else [])]
        state = self._fit(np.array(start), r, angles, rounds)
        pose = Pose2(float(state[0]), float(state[1]), wrap(float(state[2])))
        moved, turned = math.hypot(pose.x - prior.x, pose.y - prior.y), abs(wrap(pose.yaw - prior.yaw))
        if not (moved <= _FARTHEST and turned <= _MOST_TURN):
            return prior, 0.0
        errors = self._errors(state, r, angles)[0]
        quality = float((np.abs(errors) < _FIT).mean())
        if quality < ACCEPTED:
            return prior, quality
        if len(state) > 3:
            self.bias += _LEARN * (float(state[3]) - self.bias)
        return pose, quality

    def sees(self, ranges: Floats) -> bool:
        """Whether a scan can tell anything: there is a map, and enough beams have met something."""
        return self._useful and int(returns(ranges, self.max_range).sum()) >= _FEWEST

    def _fit(self, prior: Floats, ranges: Floats, angles: Floats, rounds: int) -> Floats:
        """Gauss-Newton with a Cauchy weight that narrows from 15 cm to 5 cm once the wide one has settled."""
        information = np.diag((_SIGMA / np.append(_PRIOR, self._bias_sd)[: len(prior)]) ** 2)
        state, scale = prior.copy(), _WIDE
        for _ in range(rounds):
            errors, slope = self._errors(state, ranges, angles)
            weighted = slope * (1.0 / (1.0 + (errors / scale) ** 2))[:, None]
            gradient = weighted.T @ errors + information @ (state - prior)
            step = np.linalg.solve(weighted.T @ slope + information, gradient)
            state = state - step
            if float(np.abs(step).max()) < _SETTLED:
                if scale == _NARROW:
                    break
                scale = _NARROW
        return state

    def _errors(self, state: Floats, ranges: Floats, angles: Floats) -> tuple[Floats, Floats]:
        """Clearance at every beam's end (n,), bilinear, and its derivative by x, y, yaw and, if the state has it, the ranges' bias (n, 3 or 4)."""
        c, s = math.cos(state[2]), math.sin(state[2])
        with_bias = len(state) > 3
        true = ranges - state[3] if with_bias else ranges
        ahead, beside = np.cos(angles), np.sin(angles)
        beam_x, beam_y = true * ahead, true * beside
        off_x, off_y = turned(state[2], beam_x, beam_y)
        across = (state[0] + off_x - self._origin[0]) / self._resolution
        up = (state[1] + off_y - self._origin[1]) / self._resolution
        rows, columns = self._field.shape
        # Walls stand on the map's edge: half a cell outside, the field goes on with the slope it has at the edge.
        column = np.clip(np.floor(across), 0, columns - 2).astype(np.intp)
        row = np.clip(np.floor(up), 0, rows - 2).astype(np.intp)
        u = np.clip(across - column, *_OUTSIDE)
        v = np.clip(up - row, *_OUTSIDE)
        field = self._field
        a, b = field[row, column], field[row, column + 1]
        d, e = field[row + 1, column], field[row + 1, column + 1]
        errors = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * e)
        by_x = ((1 - v) * (b - a) + v * (e - d)) / self._resolution
        by_y = ((1 - u) * (d - a) + u * (e - b)) / self._resolution
        slopes = [by_x, by_y, by_y * off_x - by_x * off_y]
        if with_bias:
            slopes.append(-by_x * (c * ahead - s * beside) - by_y * (s * ahead + c * beside))
        return errors, np.column_stack(slopes)
