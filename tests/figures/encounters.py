"""Who caused it that the robot and somebody who walks about touched: told from where the robot has been, and where the other stood."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint

_TOWARDS: Final = 0.05
"""A contact is the robot's doing when it came towards the other faster than this, m/s."""
_BEFORE: Final = 0.5
"""In so long before it, s."""
_TENTH: Final = 0.1
"""Over which the speed of the body's middle is averaged, s: the sway of a stride is not what counts."""
_AGAIN: Final = 1.0
"""Who is touched again so soon after has been touched all the time, s."""


@dataclass(frozen=True, slots=True)
class Contact:
    """A touch: of whom, when (s), and the highest speed at which the robot came towards them before it, m/s."""

    who: str
    at: float
    towards: float

    @property
    def caused(self) -> bool:
        """Whether it is the robot's doing."""
        return self.towards > _TOWARDS


class Encounters:
    """Contacts of one robot, in the order in which they began.

    Invariant: the poses that are kept are those of the last 0.6 s, their instants grow.
    """

    def __init__(self) -> None:
        self.contacts: list[Contact] = []
        self._been: deque[tuple[float, float, float, float]] = deque()
        self._last: dict[str, float] = {}
        self._footprint = Footprint()

    def see(self, now: float, robot: Pose2) -> None:
        """Take down where the robot is at the instant `now`, s; to be called for every instant, before its touches."""
        self._been.append((now, robot.x, robot.y, robot.yaw))
        while self._been[0][0] < now - _BEFORE - _TENTH:
            self._been.popleft()

    def touch(self, who: str, x: float, y: float) -> None:
        """Somebody whose middle is at (x, y) touches the robot at the instant seen last."""
        now = self._been[-1][0]
        if now - self._last.get(who, -np.inf) >= _AGAIN:
            self.contacts.append(Contact(who, round(now, 2), round(self._towards(x, y), 3)))
        self._last[who] = now

    def _towards(self, x: float, y: float) -> float:
        """How fast the robot came towards (x, y): its middle over any tenth of a second, or the part of it that is nearest now, which a
        turn may have swung there, over all of the time before.
        """
        been: Floats = np.array(self._been)
        at, pose_x, pose_y, yaw = been.T
        middle = np.hypot(pose_x - x, pose_y - y)
        ends: NDArray[np.intp] = np.asarray(np.searchsorted(at, at + _TENTH), dtype=np.intp)
        first: NDArray[np.intp] = np.flatnonzero(ends < len(at))
        if not len(first):
            return 0.0
        later = ends[first]
        fastest = float(((middle[first] - middle[later]) / (at[later] - at[first])).max())
        c, s = np.cos(yaw), np.sin(yaw)
        part_x, part_y = self._nearest(x - pose_x[-1], y - pose_y[-1], float(yaw[-1]))
        part = np.hypot(pose_x + c * part_x - s * part_y - x, pose_y + s * part_x + c * part_y - y)
        return max(fastest, float((part[0] - part[-1]) / (at[-1] - at[0])))

    def _nearest(self, dx: float, dy: float, yaw: float) -> tuple[float, float]:
        """The point of the outline, in body axes, that is nearest to a point so far from the middle in world axes, m."""
        c, s = np.cos(yaw), np.sin(yaw)
        body, half_length, half_width = self._footprint, self._footprint.length / 2, self._footprint.width / 2
        along = float(np.clip(c * dx + s * dy - body.ahead, -half_length, half_length))
        return along + body.ahead, float(np.clip(c * dy - s * dx, -half_width, half_width))
