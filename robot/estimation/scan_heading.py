"""How far odometry's heading has drifted, by the scans of the last way alone: no map is given.

Every scan is laid onto the faces of earlier ones (point to line, after Censi, "An ICP variant using a point-to-line metric", 2008; its points are
assigned by their direction from the earlier one, and weighted after Cauchy). Scans that saw something new are kept for the next ones. So the
heading drifts with the way that has been walked into the unknown, instead of with time as a gyro's does.
Equations: docs/control.md#heading-from-scans.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot.estimation.faces import Faces
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2, compose, inverse
from robot.geometry.vectors import Floats

__all__ = ["ScanHeading"]

APART: Final = 0.7
"""A scan is kept that was taken farther than this from all that are kept, m; chosen."""
MOST: Final = 60
"""Scans that are kept: those of the last 40 m."""
USED: Final = 4
"""A scan is laid onto so many of the nearest ones,"""
REACH: Final = 3.0
"""that were taken within this distance, m."""
FEWEST: Final = 60
"""Pairs of end and face; fewer say too little."""
FITTING: Final = 0.6
"""Share of the pairs that must fit,"""
FITS: Final = 0.08
"""to within this, m: four sigma of the worst LiDAR."""
ASSIGNED: Final = 0.3
"""An end may lie so far from the middle of the face that it is laid onto, m."""
ALIKE: Final = 0.9
"""Least cosine between the normals of the two."""
PRIOR: Final = (0.05, 0.05, 0.03, 0.01)
"""Standard deviations of odometry since the last scan, m, m, rad, and of the ranges' bias, m: all there is along a bare corridor; chosen."""
SIGMA: Final = 0.02
"""Of an end, m."""
WIDE, NARROW = 0.10, 0.03
"""Scales of the Cauchy weight, m: first five sigma, then one and a half; chosen."""
ROUNDS: Final = 12
"""Gauss-Newton steps at most."""
SETTLED: Final = 2e-4
"""A step below this in every part (m, rad) ends the search at one scale; chosen."""
FARTHEST, MOST_TURN = 0.2, 0.1
"""A correction beyond this (m, rad) is a mistake."""
SURE: Final = 2e-3
"""Standard deviation of a heading that says something, rad."""
GAIN: Final = 0.3
"""Share of a scan's correction that is taken at once; chosen: a scan's noise is its own, its heading is not."""
DRIFT: Final = 0.05
"""Share of a turn that counts as drift from one scan to the next; chosen: GAIN squared over (2 - GAIN), as Benedict and Bordner have it."""
LEARN: Final = 0.1
"""Share of what a scan says of the ranges' bias that is believed at once; chosen."""


@dataclass(frozen=True, slots=True)
class _View:
    """A scan that is kept, and where it was taken."""

    pose: Pose2
    faces: Faces


class ScanHeading:
    """Follows the robot by its scans. Takes about 3 ms for each scan of 360 beams."""

    def __init__(self) -> None:
        self._views: deque[_View] = deque(maxlen=MOST)
        self._here: Pose2 | None = None
        self._odom = Pose2(0.0, 0.0)
        self._drift = 0.0
        """By which a heading has to be turned from one scan to the next, rad."""
        self.bias = 0.0
        """By which all ranges are too long, as far as scans have shown, m."""

    def __repr__(self) -> str:
        return f"<ScanHeading: {len(self._views)} scans kept>"

    def clear(self) -> None:
        """Forget everything: odometry has begun anew."""
        self._views.clear()
        self._here, self._drift = None, 0.0

    def update(self, odom: Pose2, ranges: Floats) -> float | None:
        """By how much odometry's heading is too large, rad, after a level scan that was taken where odometry has the pose `odom`.

        None where the scan does not tell: it shows too little, does not fit, or nothing was seen here before.
        """
        faces = Faces(ranges)
        self._here = here = self._carried(odom)
        self._odom = odom
        near = self._near(here)
        fitted = self._fit(here, faces, near) if near else None
        if fitted is not None:
            step = compose(inverse(here), fitted)
            self._here = here = compose(here, Pose2(GAIN * step.x, GAIN * step.y, GAIN * step.yaw))
            self._drift += DRIFT * step.yaw
        if not near or _apart(near[0].pose, here) > APART:
            self._views.append(_View(here, faces))
        return wrap(odom.yaw - here.yaw) if fitted is not None else None

    def _carried(self, odom: Pose2) -> Pose2:
        """Where the robot is by odometry since the last scan, less the drift that is known."""
        if self._here is None:
            return odom
        step = compose(inverse(self._odom), odom)
        return compose(self._here, Pose2(step.x, step.y, step.yaw + self._drift))

    def _near(self, here: Pose2) -> list[_View]:
        """The views to lay a scan onto, the nearest first."""
        near = sorted(self._views, key=lambda view: _apart(view.pose, here))[:USED]
        return [view for view in near if _apart(view.pose, here) < REACH]

    def _fit(self, prior: Pose2, faces: Faces, views: list[_View]) -> Pose2 | None:
        """Gauss-Newton with a weight that narrows once the wide one has settled."""
        first = state = np.array([prior.x, prior.y, prior.yaw, self.bias])
        information = np.diag((SIGMA / np.array(PRIOR)) ** 2)
        scale = WIDE
        for _ in range(ROUNDS):
            errors, slope = _pairs(state, faces, views)
            if len(errors) < FEWEST:
                return None
            weighted = slope / (1.0 + (errors / scale) ** 2)[:, None]
            hessian = weighted.T @ slope + information
            step = np.linalg.solve(hessian, weighted.T @ errors + information @ (state - first))
            state = state - step
            if float(np.abs(step).max()) < SETTLED:
                if scale == NARROW:
                    break
                scale = NARROW
        moved, turned = math.hypot(*(state - first)[:2]), abs(float(state[2] - first[2]))
        fitting = float((np.abs(errors) < FITS).mean())
        deviation = SIGMA * math.sqrt(float(np.linalg.inv(hessian)[2, 2]))
        if fitting < FITTING or moved > FARTHEST or turned > MOST_TURN or deviation > SURE:
            return None
        self.bias += LEARN * (float(state[3]) - self.bias)
        return Pose2(float(state[0]), float(state[1]), wrap(float(state[2])))


def _apart(a: Pose2, b: Pose2) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)


def _pairs(state: Floats, faces: Faces, views: list[_View]) -> tuple[Floats, Floats]:
    """Distances (m) of the scan's ends from the faces of all views, shape (n,), and their derivatives by x, y, yaw and bias, shape (n, 4)."""
    known, bias = faces.known, state[3]
    looks = _turned(faces.looks[known], state[2])
    points, normals = _turned(faces.points[known], state[2]) - bias * looks, _turned(faces.normals[known], state[2])
    errors: list[Floats] = []
    slopes: list[Floats] = []
    for view in views:
        seen, pose = view.faces, view.pose
        ends = _turned(points + np.array([state[0] - pose.x, state[1] - pose.y]), -pose.yaw)
        count = len(seen.points)
        beam = np.rint((np.arctan2(ends[:, 1], ends[:, 0]) + math.pi) * (count / math.tau)).astype(np.intp) % count
        off, across = ends - seen.middles[beam] + bias * seen.looks[beam], seen.normals[beam]
        error, looking = (off * across).sum(axis=1), _turned(across, pose.yaw)
        pair = seen.known[beam] & ((off**2).sum(axis=1) < ASSIGNED**2) & ((looking * normals).sum(axis=1) > ALIKE)
        by_yaw = looking[:, 1] * points[:, 0] - looking[:, 0] * points[:, 1]
        errors.append(error[pair])
        by_bias = (across * seen.looks[beam]).sum(axis=1) - (looking * looks).sum(axis=1)
        slopes.append(np.column_stack((looking, by_yaw, by_bias))[pair])
    return np.concatenate(errors), np.concatenate(slopes)


def _turned(vectors: Floats, angle: float) -> Floats:
    """Row vectors, shape (n, 2), turned counter-clockwise by `angle`."""
    c, s = math.cos(angle), math.sin(angle)
    return vectors @ np.array([[c, s], [-s, c]])
