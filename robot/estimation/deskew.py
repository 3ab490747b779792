"""What a level LiDAR at the body's origin would have seen at one instant, from a revolution that took a while in a body that walked and leaned.

Every beam's end is put where the body was when the beam looked, by odometry, and is seen from where the body is at the end; the
ranges of the regular beams are then read from between those ends. Equations: docs/concepts/control.md#deskewing.
"""

from __future__ import annotations

from math import tau

import numpy as np

from robot.estimation.history import History
from robot.geometry.vectors import Floats, Vector, wrap_all
from robot.hardware.beams import MAX_RANGE, NEAREST, beam_angles
from robot.model.footprint import Footprint

UNKNOWN = 0.0
"""The range (m) of a beam of which nothing is known: floor, own legs or nothing at all lay there. It is below every sensor's least range."""
_FLOOR, _FLOOR_PER_METRE = 0.08, 0.012
"""Ends below this height, m, and so much more per metre of the beam, are the floor: terrain, and tilt that is wrong by 0.7 degrees; chosen."""
_LEGS = 0.02
"""Ends within the body's outline, or so near to it, are the robot's own legs, m."""
_STEP = 0.3
"""Two ends beside each other lie on one face if their ranges differ by less than this, m, or by `_STEEP`; chosen."""
_STEEP = 0.05
"""Relative difference of two ranges on one face: half a degree of a wall that is seen under 10 degrees; chosen."""
_LEAST_GAP = 1e-12
"""Two ends in the very same direction count as so far apart, rad."""
_BESIDE = 1.5
"""A regular beam is read only from ends at most so many beams away on both sides."""


class Deskew:
    """Poses of the body in odom over the last two seconds, and the correction of sweeps by them. Their stamps grow strictly."""

    def __init__(self, outline: Footprint | None = None, max_range: float = MAX_RANGE) -> None:
        self._outline = outline or Footprint()
        self._max_range = max_range
        self._poses: History[Vector] = History(_between)

    def __repr__(self) -> str:
        return f"Deskew({self._poses!r})"

    @property
    def newest(self) -> float | None:
        """Stamp of the newest pose, s."""
        return self._poses.newest

    def add(self, stamp: float, position: tuple[float, float, float], attitude: tuple[float, float, float]) -> None:
        """The body's place (m; z over the floor) and its roll, pitch and yaw (rad) at `stamp` (s). Poses that are not older are forgotten."""
        self._poses.add(stamp, np.array([*position, *attitude]))

    def clear(self) -> None:
        """Forget all poses: odometry has started over."""
        self._poses.clear()

    def corrected(self, ranges: Floats, start: float, sweep: float, at: float) -> Floats | None:
        """The ranges (m) of as many level beams from the body's origin at the instant `at`; None where the poses do not reach back to `start`.

        Beam i of `ranges` looked along -pi + i 2 pi / n, in the plane of the body's x and y, at ``start + i sweep / n``. In the result the
        maximum is no return, as in `ranges`, and 0 says that nothing is known of this beam.
        """
        oldest, then = self._poses.oldest, self._poses.at(at)
        if oldest is None or oldest > start or then is None:
            return None
        count = len(ranges)
        table = np.array([(stamp, *pose) for stamp, pose in self._poses.items])
        stamps = table[:, 0]
        table[:, 6] = np.unwrap(table[:, 6])
        times = start + np.arange(count) * (sweep / count)
        lay: list[Floats] = [np.interp(times, stamps, table[:, column]) for column in range(1, 7)]
        x, y, z, roll, pitch, yaw = lay
        x1, y1, _, _, _, yaw1 = then.tolist()
        reach = np.where(np.isfinite(ranges), ranges, UNKNOWN)
        forward, left, up = _leveled(reach, beam_angles(count), roll, pitch)
        own = self._outline.distances(forward, left) < _LEGS
        c, s = np.cos(yaw - yaw1), np.sin(yaw - yaw1)
        dx, dy = x - x1, y - y1
        c1, s1 = np.cos(yaw1), np.sin(yaw1)
        ahead = c * forward - s * left + c1 * dx + s1 * dy
        beside = s * forward + c * left + c1 * dy - s1 * dx
        free = reach >= self._max_range - NEAREST
        floor = z + up < _FLOOR + _FLOOR_PER_METRE * reach
        seen = np.where(free, self._max_range, np.hypot(ahead, beside))
        known = (reach > NEAREST) & ~own & ~(floor & ~free)
        # A beam of which nothing is known has no end, but it has a direction, and so has one that goes on for ever.
        directions = np.where(known & ~free, np.arctan2(beside, ahead), wrap_all(beam_angles(count) + yaw - yaw1))
        return self._regular(directions, np.where(known, seen, UNKNOWN))

    def _regular(self, angles: Floats, ranges: Floats) -> Floats:
        """The ranges of regular beams, from those at any angles. Between two ends on one face the face is straight; else the nearer beam counts."""
        count = len(ranges)
        order = np.argsort(angles, kind="stable")
        angles, ranges = angles[order], ranges[order]
        angles = np.concatenate((angles[-2:] - tau, angles, angles[:2] + tau))
        ranges = np.concatenate((ranges[-2:], ranges, ranges[:2]))
        wanted = beam_angles(count)
        after = np.searchsorted(angles, wanted)
        a, b = after - 1, after
        before, behind = wanted - angles[a], angles[b] - wanted
        ra, rb = ranges[a], ranges[b]
        nearer = np.where(before <= behind, ra, rb)
        gap = np.minimum(before, behind)
        hits = (ra > NEAREST) & (rb > NEAREST) & (ra < self._max_range) & (rb < self._max_range)
        together = hits & (np.abs(ra - rb) < np.maximum(_STEP, _STEEP * np.minimum(ra, rb)))
        # A straight line in polar coordinates: 1 / r runs like a sine of the angle, over half a degree like the angle itself.
        share = before / np.maximum(before + behind, _LEAST_GAP)
        inverse = (1.0 - share) / np.maximum(ra, NEAREST) + share / np.maximum(rb, NEAREST)
        result = np.where(together, 1.0 / inverse, nearer)
        return np.asarray(np.where(gap > _BESIDE * tau / count, UNKNOWN, result), dtype=np.float64)


def _between(a: Vector, b: Vector, share: float) -> Vector:
    way = b - a
    way[3:] = wrap_all(way[3:])
    return a + share * way


def _leveled(reach: Floats, angles: Floats, roll: Floats, pitch: Floats) -> tuple[Floats, Floats, Floats]:
    """The ends of beams in the body's plane, in axes that share its heading but are level."""
    x, y = reach * np.cos(angles), reach * np.sin(angles)
    side, rise = y * np.cos(roll), y * np.sin(roll)
    return x * np.cos(pitch) + rise * np.sin(pitch), side, rise * np.cos(pitch) - x * np.sin(pitch)
