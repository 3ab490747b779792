"""Where the robot was when a measurement was taken: its poses of the last seconds, by their stamps."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2

__all__ = ["PoseHistory"]

KEEP = 2.0
"""For how long before the newest poses are kept, s: a measurement that is on its way for longer says nothing about now."""


class PoseHistory:
    """Stamped poses of the last two seconds.

    The stamps that are kept grow strictly: a new pose takes the place of all that are not older. So one that was overtaken on its way
    costs the few that overtook it, and after the clock was set back the history goes on from there.
    """

    __slots__ = ("_poses", "_stamps")

    def __init__(self) -> None:
        self._stamps: deque[float] = deque()
        self._poses: deque[Pose2] = deque()

    def add(self, stamp: float, pose: Pose2) -> None:
        """Keep the pose of the instant `stamp`, s."""
        while self._stamps and self._stamps[-1] >= stamp:
            self._stamps.pop()
            self._poses.pop()
        self._stamps.append(stamp)
        self._poses.append(pose)
        while self._stamps[0] < stamp - KEEP:
            self._stamps.popleft()
            self._poses.popleft()

    def clear(self) -> None:
        """Forget all poses: they do not go on where the next one begins."""
        self._stamps.clear()
        self._poses.clear()

    def at(self, stamp: float) -> Pose2 | None:
        """The pose of an instant, between two poses on the straight line and by the shorter turn.

        After the newest pose it is the newest one, before the first one that is kept there is none.
        """
        stamps, poses = self._stamps, self._poses
        if not stamps or stamp < stamps[0]:
            return None
        if stamp >= stamps[-1]:
            return poses[-1]
        after = bisect_left(stamps, stamp)
        if stamps[after] == stamp:
            return poses[after]
        share = (stamp - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
        a, b = poses[after - 1], poses[after]
        return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), wrap(a.yaw + share * wrap(b.yaw - a.yaw)))
