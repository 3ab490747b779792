"""The guard of a person who drives: it slows the robot down, and stops it short of what the LiDAR sees, as nav2's collision monitor does."""

from __future__ import annotations

from math import hypot, inf, sin, sqrt
from typing import Final

import numpy as np

from robot.geometry.planar import Pose2, Twist2, seen_from, turned
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns
from robot.model.footprint import Footprint

FAR: Final = 3.0
"""What is farther away does not matter, m: the robot stops from 1.6 m/s in half of that."""
AHEAD, STEP = 3.0, 0.1
"""So far the drive is looked ahead, in such steps, s."""
MARGIN: Final = 0.15
"""Room that is left around the body's outline, m; chosen: what the legs sway, and five sigma of the LiDAR."""
BRAKING: Final = 0.8
"""What it brakes with, m/s2."""
LATENCY: Final = 0.3
"""From what was seen to the body's answer, s: a turn of the LiDAR, and what the legs take to answer."""
CORNER: Final = 0.6
"""How far the corners of the body are from its middle, m: a turn of 1 rad/s moves them by that in a second."""
NEARER: Final = 0.005
"""What comes nearer by less than this does not come nearer, m: a robot that stands too near may leave."""


class Guard:
    """Knows the latest scan. Invariant: a velocity is only ever made smaller, as a whole, so that the robot stays on the curve it was sent on."""

    __slots__ = ("_at", "_footprint", "_points")

    def __init__(self, footprint: Footprint | None = None) -> None:
        self._footprint = footprint or Footprint()
        self._points: tuple[Floats, Floats] = (np.empty(0), np.empty(0))
        self._at = -inf

    def see(self, now: float, ranges: Floats) -> None:
        """Take in a scan (m): beam i looks along -pi + i 2 pi / n in body axes."""
        near = returns(ranges, MAX_RANGE, nearest=0.0) & (ranges < FAR)
        angles = beam_angles(len(ranges))[near]
        x, y = ranges[near] * np.cos(angles), ranges[near] * np.sin(angles)
        outside = self._footprint.distances(x, y) > 0.0
        self._points, self._at = (x[outside], y[outside]), now

    def age(self, now: float) -> float:
        """Seconds since the latest scan; inf before the first."""
        return now - self._at

    def limit(self, wanted: Twist2) -> tuple[Twist2, float]:
        """The velocity that leaves room to stop, and how far the body can go on this curve, m (inf: far enough)."""
        rate = hypot(wanted.vx, wanted.vy) + CORNER * abs(wanted.wz)
        if rate <= 0.0 or not len(self._points[0]):
            return wanted, inf
        room = self._free_for(wanted) * rate
        braked = BRAKING * LATENCY
        allowed = sqrt(braked * braked + 2.0 * BRAKING * room) - braked  # v latency + v^2 / 2 a = room
        if allowed >= rate:
            return wanted, inf
        share = allowed / rate
        return Twist2(share * wanted.vx, share * wanted.vy, share * wanted.wz), room

    def _free_for(self, wanted: Twist2) -> float:
        """Seconds for which the body goes on at this velocity before something is nearer than the margin; inf if that is long."""
        x, y = self._points
        now = self._footprint.distances(x, y)
        for step in range(1, round(AHEAD / STEP) + 1):
            seconds = step * STEP
            turn = wanted.wz * seconds
            # Where a body is that went on for so long: the chord of the arc, turned by half of the turn.
            chord = seconds * (sin(turn / 2) / (turn / 2) if turn else 1.0)
            ahead, left = (chord * part for part in turned(turn / 2, wanted.vx, wanted.vy))
            there = self._footprint.distances(*seen_from(Pose2(ahead, left, turn), x, y))
            if ((there < MARGIN) & (there < now - NEARER)).any():
                return seconds - STEP
        return inf
