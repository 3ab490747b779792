"""Where the charging station is, by what the LiDAR sees of its face (docs/concepts/control.md#docking)."""

from __future__ import annotations

import math

import numpy as np

from robot.geometry.planar import Pose2, compose, inverse
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns
from robot.scenes.dock import FACE_AHEAD, FACE_WIDTH

_WINDOW = 0.10
"""A return this near to where the face should be may be the face, m; what stands behind the station is 0.15 m farther."""
_BESIDE = 0.30
"""How far beside the face's expected ends returns may still be its own, m: 10 cm, and 10 degrees from a meter away."""
_GAP = 0.12
"""Neighbouring returns farther apart than this are of different things, m: six sigma of the LiDAR, and a lost beam or two."""
_FEWEST = 8
"""Returns from the face; fewer say too little."""
_OFF = 0.06
"""A return farther than this off the fitted face is something else, m: four sigma of the LiDAR."""
_EXTENT = (0.28, 0.47)
"""A face that seems narrower is half hidden, and a wider one is a wall, m."""
_CROOKED = 0.4
"""A face turned farther than this from where it should be is none, rad."""


def find_dock(ranges: Floats, here: Pose2, dock: Pose2, max_range: float = MAX_RANGE) -> Pose2 | None:
    """The robot's pose in the frame of the dock (x ahead, the docked robot at zero), or None when the station's face is not seen.

    `ranges` (m) as in a scan: beam i looks along yaw - pi + i 2 pi / n. `here` and `dock` are in one frame, and `here` is known to
    within some 10 cm and 10 degrees; the answer rests on one scan of the face alone:
    half of them are within 3 cm and 2 degrees from a meter away. Average several.
    """
    believed = compose(inverse(dock), here)
    valid = returns(ranges, max_range)
    angles, r = beam_angles(len(ranges))[valid] + believed.yaw, ranges[valid]
    x, y = believed.x + r * np.cos(angles), believed.y + r * np.sin(angles)
    near = (np.abs(x - FACE_AHEAD) < _WINDOW) & (np.abs(y) < FACE_WIDTH / 2 + _BESIDE)
    line = _line(*_longest_run(x[near], y[near]))
    if line is None:
        return None
    at, slope, low, high = line
    length = (high - low) * math.hypot(1.0, slope)
    turn = -math.atan(slope)
    if not (_EXTENT[0] <= length <= _EXTENT[1] and abs(turn) <= _CROOKED):
        return None
    # The face as seen, a pose in the dock's frame as believed; the true face stands at FACE_AHEAD, straight.
    middle = (low + high) / 2
    seen = Pose2(at + slope * middle, middle, turn)
    return compose(Pose2(FACE_AHEAD, 0.0, 0.0), compose(inverse(seen), believed))


def _longest_run(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The most returns, in the order of y, of which each is near its neighbours: a thing beside the face is not of it."""
    order = np.argsort(y)
    x, y = x[order], y[order]
    breaks = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > _GAP) + 1
    return max(zip(np.split(x, breaks), np.split(y, breaks), strict=True), key=lambda run: len(run[0]))


def _line(x: Floats, y: Floats) -> tuple[float, float, float, float] | None:
    """The straight line x = at + slope y through the returns, less what lies off it, and the least and largest y on it."""
    for _ in range(3):
        if len(x) < _FEWEST:
            return None
        slope, at = (float(v) for v in np.polyfit(y, x, 1))
        fits = np.abs(x - at - slope * y) < _OFF
        if fits.all():
            return at, slope, float(y.min()), float(y.max())
        x, y = x[fits], y[fits]
    return None
