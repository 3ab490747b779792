"""Things that walk: which of the unmapped hits move, how fast, and where they will be.

Hits that lie side by side form a cluster; a cluster is followed from scan to scan by its middle. Only what is small,
moves steadily and leaves the places where it was counts as moving: the visible middle of a standing box also wanders
while the robot walks past it. The filter of its velocity: docs/concepts/control.md#local-costmap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats

_GAP = 0.3
"""Neighboring hits farther apart than this belong to two things, m."""
_LARGEST = 1.0
"""Wider clusters are not followed, m: their visible part changes too much."""
_REACH = 0.4
"""How far a thing may be from where it was expected, m."""
_SLOWEST = 0.15
"""Slower than this counts as standing, m/s."""
_STANDING_SHARE = 0.8
"""With this share of its hits on places already known for a while, a thing stands."""
_LOST = 0.6
"""A thing unseen for longer is forgotten, s."""
_SCANS = 3
"""Scans before a speed is believed."""
_GONE = 0.25
"""How far a thing must have come from where it was first seen, m: the part of a standing thing that shows wanders about less."""
_SKIN = 0.05
"""A thing's radius is that of the hits and so much more, m: half of it is out of sight; chosen."""
_SHRINKING = 0.98
"""Of the largest radius seen, per scan: it falls to a third within some five seconds; chosen."""
_NEW_SHARE = 0.4
"""Share of the newest difference in the filtered speed."""


@dataclass(frozen=True, slots=True)
class Mover:
    """A moving disc: middle (m), velocity (m/s), radius (m), at the instant of the last scan."""

    x: float
    y: float
    vx: float
    vy: float
    radius: float


@dataclass(slots=True)
class _Track:
    x: float
    y: float
    radius: float
    seen: float
    first_x: float
    first_y: float
    vx: float = 0.0
    vy: float = 0.0
    scans: int = 1
    standing: bool = True


class Movers:
    """Follows clusters of hits over time."""

    def __init__(self) -> None:
        self._tracks: list[_Track] = []

    def __repr__(self) -> str:
        return f"Movers({len(self.moving)} moving of {len(self._tracks)} things followed)"

    @property
    def moving(self) -> tuple[Mover, ...]:
        """What moves, as far as is known since the latest `update` or `age`."""
        return tuple(
            Mover(t.x, t.y, t.vx, t.vy, t.radius)
            for t in self._tracks
            if t.scans >= _SCANS
            and not t.standing
            and math.hypot(t.vx, t.vy) >= _SLOWEST
            and math.hypot(t.x - t.first_x, t.y - t.first_y) >= _GONE
        )

    def forget(self) -> None:
        """Start over."""
        self._tracks = []

    def age(self, now: float) -> None:
        """Forget what no scan has shown for more than 0.6 s, whether it has left or scans have stopped coming."""
        self._tracks = [track for track in self._tracks if now - track.seen <= _LOST]

    def update(self, now: float, x: Floats, y: Floats, known: NDArray[np.bool_]) -> None:
        """Take in the unmapped hits of one scan, in beam order (m); `known`: the hit's place was already marked a while
        ago. A scan without such hits counts, too: it shows that what was followed is gone.
        """
        self.age(now)
        clusters = _clusters(x, y)
        free = self._tracks
        fresh: list[_Track] = []
        for part in clusters:
            cx, cy = float(x[part].mean()), float(y[part].mean())
            size = float(np.hypot(x[part] - cx, y[part] - cy).max())
            if 2 * size > _LARGEST:
                continue
            standing = float(known[part].mean()) >= _STANDING_SHARE
            track = _nearest(free, now, cx, cy)
            if track is None:
                fresh.append(_Track(cx, cy, size + _SKIN, now, cx, cy))
            else:
                free.remove(track)
                fresh.append(_advanced(track, now, cx, cy, size + _SKIN, standing))
        self._tracks = fresh + free


def _clusters(x: Floats, y: Floats) -> Sequence[NDArray[np.intp]]:
    if len(x) == 0:
        return ()
    cuts = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > _GAP) + 1
    return [part for part in np.split(np.arange(len(x)), cuts) if len(part) >= 3]


def _nearest(tracks: list[_Track], now: float, x: float, y: float) -> _Track | None:
    best, least = None, _REACH
    for track in tracks:
        wait = now - track.seen
        gap = math.hypot(track.x + track.vx * wait - x, track.y + track.vy * wait - y)
        if gap < least:
            best, least = track, gap
    return best


def _advanced(track: _Track, now: float, x: float, y: float, radius: float, standing: bool) -> _Track:
    wait = now - track.seen
    if wait <= 0.0:
        return track
    share = max(_NEW_SHARE, 1.0 / track.scans)
    vx = track.vx + share * ((x - track.x) / wait - track.vx)
    vy = track.vy + share * ((y - track.y) / wait - track.vy)
    # The far side of a thing is hidden: keep the largest radius seen, letting it shrink slowly.
    largest = max(radius, _SHRINKING * track.radius)
    return _Track(x, y, largest, now, track.first_x, track.first_y, vx, vy, track.scans + 1, standing)
