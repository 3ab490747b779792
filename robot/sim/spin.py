"""A LiDAR that turns while the body under it moves: its beams look one group after the other, each from where the body is then."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np

from robot.geometry.vectors import Floats
from robot.hardware.beams import BEAMS, beam_angles
from robot.hardware.body import Sweep

UNREAD = 2
"""Whole revolutions that nobody has taken, after which no more are looked at: the newest, and one that ends while its reader is on the way."""
GROUP = 0.005
"""Time of the beams that look at once, s: the period of the other sensors, so that a turning LiDAR chops no step of the simulation up."""


def beam_directions(angles: Floats) -> Floats:
    """Unit vectors in the sensor's axes, shape (n, 3): its beams lie in its plane of x and y."""
    return np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))


class Spin:
    """One revolution after the other, each of `sweep` seconds.

    `look` tells the ranges (m) of beams in the given directions (unit vectors in the sensor's axes) now. The code that moves the body asks `due` when
    that is wanted next, and calls `turn` at that instant. What `take` gives is never a part of a revolution. Those that nobody takes are not computed.
    """

    def __init__(self, sweep: float, look: Callable[[Floats], Floats]) -> None:
        self._sweep, self._look = sweep, look
        self._parts = np.array_split(beam_directions(beam_angles(BEAMS)), max(1, round(sweep / GROUP)))
        self._seen: list[Floats] = []
        self._began = inf
        self._revolutions = 0
        self._unread = 0
        self._newest: Sweep | None = None

    @property
    def begun(self) -> bool:
        """Whether it turns."""
        return self._began < inf

    def begin(self, now: float) -> None:
        """Turn from now on."""
        self._began = now

    def take(self) -> Sweep | None:
        """The newest whole revolution."""
        if self._unread >= UNREAD:
            self._revolutions += 1  # the one under way is missed; the next is looked at
        self._unread = 0
        return self._newest

    @property
    def due(self) -> float:
        """When the next group looks: at the end of its time; never before `begin`, and while nobody takes what it has seen, once a revolution."""
        if self._unread >= UNREAD:
            return self._began + self._sweep * (self._revolutions + 1)
        return self._began + self._sweep * (self._revolutions + (len(self._seen) + 1) / len(self._parts))

    def turn(self) -> None:
        """Look with the next group of beams, or let a whole revolution pass that nobody wants."""
        if self._unread >= UNREAD:
            self._revolutions += 1
            return
        self._seen.append(self._look(self._parts[len(self._seen)]))
        if len(self._seen) == len(self._parts):
            # A group looks at the end of its time, so its beams are half a group later than if each looked at its own.
            start = self._began + self._revolutions * self._sweep + 0.5 * self._sweep / len(self._parts)
            self._newest = Sweep(start, self._sweep, np.concatenate(self._seen))
            self._seen = []
            self._revolutions += 1
            self._unread += 1
