"""How far odometry's heading has drifted, by the scans of the last way alone: no map is given.

Every scan is laid onto the faces of earlier ones (point to line, after Censi, "An ICP variant using a point-to-line metric", 2008; its points are
assigned by their direction from the earlier one, and weighted after Cauchy). Scans that saw something new are kept for the next ones. So the
heading drifts with the way that has been walked into the unknown, instead of with time as a gyro's does.
Equations: docs/concepts/control.md#heading-from-scans.
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

APART: Final = 0.7
"""A scan is kept that was taken farther than this from all that are kept, m; chosen."""
MOST: Final = 60
"""Scans that are kept: those of the last 40 m."""
USED: Final = 4
"""A scan is laid onto so many of the nearest ones,"""
REACH: Final = 3.0
"""that were taken within this distance, m."""
FEWEST: Final = 20
"""Pairs of end and face; fewer say too little."""
FITTING: Final = 0.6
"""Share of the pairs that must fit,"""
FITS: Final = 0.08
"""to within this, m: four sigma of the worst LiDAR."""
ASSIGNED: Final = 0.3
"""An end may lie so far from the middle of the face that it is laid onto, m."""
ALIKE: Final = 0.9
"""Least cosine between the normals of the two."""
SIGMA: Final = 0.05
"""Standard deviation that one pair counts with, m; chosen: two and a half times the LiDAR's, as the pairs of one face share its errors."""
WIDE, NARROW = 0.10, 0.03
"""Scales of the Cauchy weight, m; chosen."""
ROUNDS: Final = 12
"""Gauss-Newton steps at most."""
SETTLED: Final = 2e-4
"""A step below this in every part (m, rad) ends the search at one scale; chosen."""
FARTHEST, MOST_TURN = 0.2, 0.1
"""A correction beyond this (m, rad) is a mistake."""
PATIENCE: Final = 25
"""After so many scans in a row that do not fit, 5 s of them, what was seen before is forgotten: things have moved, or the robot was carried."""
FIRST: Final = (1e-3, 1e-3, 1e-4, 3e-4, 0.02)
"""Standard deviations where nothing was seen before, of place (m), heading (rad), its drift from scan to scan (rad) and the ranges' bias (m)."""
WALK: Final = (3e-3, 3e-3, 2e-4, 2e-5, 1e-4)
"""By which the same grow from scan to scan; chosen: the legs' place, and a gyro whose scale is off by 0.2 % in a turn."""


@dataclass(frozen=True, slots=True)
class _View:
    """A scan that is kept, and where it was taken."""

    pose: Pose2
    faces: Faces


class ScanHeading:
    """Follows the robot by its scans, as an iterated extended Kalman filter. Takes about 3 ms for each scan of 360 beams.

    The state is x, y (m), heading (rad), its drift from one scan to the next (rad), and by which all ranges are too long (m).
    """

    def __init__(self) -> None:
        self._views: deque[_View] = deque(maxlen=MOST)
        self._odom: Pose2 | None = None
        self._state: Floats = np.zeros(5)
        self._covariance: Floats = np.diag(np.square(FIRST))
        self._refused = 0
        """Scans since the last one that fitted, without those that show too little."""

    def __repr__(self) -> str:
        return f"<ScanHeading: {len(self._views)} scans kept>"

    @property
    def bias(self) -> float:
        """By which all ranges are too long, as far as scans have shown, m."""
        return float(self._state[4])

    def clear(self) -> None:
        """Forget everything but the ranges' bias: odometry has started over."""
        self._views.clear()
        self._odom, self._refused = None, 0

    def update(self, odom: Pose2, ranges: Floats) -> float | None:
        """By how much odometry's heading is too large, rad, after a level scan that was taken where odometry has the pose `odom`.

        None where the scan does not tell: it shows too little, does not fit, or nothing was seen here before.
        """
        faces = Faces(ranges)
        self._predict(odom)
        views = self._near()
        told = bool(views) and self._correct(faces, views)
        shows = int(faces.known.sum()) >= FEWEST
        self._refused = 0 if told or not views else self._refused + shows
        if self._refused >= PATIENCE:
            views, self._refused = [], 0
            self._views.clear()
        if not views:
            self._settle()
        if not views or _apart(views[0].pose, self._here) > APART:
            self._views.append(_View(self._here, faces))
        return wrap(odom.yaw - float(self._state[2])) if told else None

    @property
    def _here(self) -> Pose2:
        x, y, yaw = self._state[:3].tolist()
        return Pose2(x, y, wrap(yaw))

    def _predict(self, odom: Pose2) -> None:
        """Where the robot is by odometry since the last scan, less the drift that is known."""
        if self._odom is None:
            self._state[:4] = odom.x, odom.y, odom.yaw, 0.0
        else:
            before, step = self._here, compose(inverse(self._odom), odom)
            after = compose(before, Pose2(step.x, step.y, step.yaw + float(self._state[3])))
            self._state[:3] = after.x, after.y, after.yaw
            growth = np.eye(5)
            growth[0, 2], growth[1, 2], growth[2, 3] = before.y - after.y, after.x - before.x, 1.0
            self._covariance = growth @ self._covariance @ growth.T + np.diag(np.square(WALK))
        self._odom = odom

    def _settle(self) -> None:
        """Nothing is known here: what is seen from now on is seen from this pose."""
        spread = np.square(FIRST)
        spread[4] = min(spread[4], self._covariance[4, 4])
        self._covariance = np.diag(spread)

    def _near(self) -> list[_View]:
        """The views to lay a scan onto, the nearest first."""
        here = self._here
        near = sorted(self._views, key=lambda view: _apart(view.pose, here))[:USED]
        return [view for view in near if _apart(view.pose, here) < REACH]

    def _correct(self, faces: Faces, views: list[_View]) -> bool:
        """Gauss-Newton with a weight that narrows once the wide one has settled. False, without effect, if the scan does not fit."""
        first = state = self._state
        prior, scale, rounds = np.linalg.inv(self._covariance), WIDE, ROUNDS
        while True:
            errors, slope = _pairs(state, faces, views)
            if len(errors) < FEWEST:
                return False
            weighted = slope / (SIGMA**2 * (1.0 + (errors / scale) ** 2))[:, None]
            information: Floats = weighted.T @ slope + prior
            step = np.linalg.solve(information, weighted.T @ errors + prior @ (state - first))
            state = state - step
            rounds -= 1
            settled = float(np.abs(step).max()) < SETTLED
            if rounds == 0 or (settled and scale == NARROW):
                break
            if settled:
                scale = NARROW
        moved = state - first
        far = math.hypot(moved[0], moved[1]) > FARTHEST or abs(float(moved[2])) > MOST_TURN
        if far or float((np.abs(errors) < FITS).mean()) < FITTING:
            return False
        self._state, self._covariance = state, np.asarray(np.linalg.inv(information), dtype=np.float64)
        return True


def _apart(a: Pose2, b: Pose2) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)


def _pairs(state: Floats, faces: Faces, views: list[_View]) -> tuple[Floats, Floats]:
    """Distances (m) of the scan's ends from the faces of all views, shape (n,), and their derivatives by the state, shape (n, 5)."""
    known, bias = faces.known, state[4]
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
        slopes.append(np.column_stack((looking, by_yaw, np.zeros(len(points)), by_bias))[pair])
    return np.concatenate(errors), np.concatenate(slopes)


def _turned(vectors: Floats, angle: float) -> Floats:
    """Row vectors, shape (n, 2), turned counter-clockwise by `angle`."""
    c, s = math.cos(angle), math.sin(angle)
    turned: Floats = vectors @ np.array([[c, s], [-s, c]])
    return turned
