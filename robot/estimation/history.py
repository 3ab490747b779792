"""How something was when a measurement was taken: its values of the last two seconds, by their stamps."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeAlias, TypeVar

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Vector

T = TypeVar("T")

KEEP = 2.0
"""For how long before the newest value others are kept, s: a measurement that is on its way for longer says nothing about now."""
JUMP = 0.5
"""An odometry step longer than this, m, beside what the robot may have gone meanwhile, means that odometry has started over."""
FASTEST = 2.0
"""What the robot may have gone meanwhile, along and across together, m/s; more than it can."""

Attitude: TypeAlias = tuple[Vector, float]
"""A quaternion (w, x, y, z) of any length, and a height, m."""


class History(Generic[T]):
    """Stamped values of the last two seconds; `between` makes the one at a share of the way from one value to the next.

    The stamps that are kept grow strictly: a new value takes the place of all that are not older. So one that was overtaken on its way
    costs the few that overtook it, and after the clock was set back the history goes on from there.
    """

    __slots__ = ("_between", "_stamps", "_values")

    def __init__(self, between: Callable[[T, T, float], T]) -> None:
        self._between = between
        self._stamps: deque[float] = deque()
        self._values: deque[T] = deque()

    def __repr__(self) -> str:
        return f"<History: {len(self._stamps)} values>"

    @property
    def newest(self) -> float | None:
        """Stamp of the newest value, s."""
        return self._stamps[-1] if self._stamps else None

    @property
    def oldest(self) -> float | None:
        """Stamp of the oldest value that is kept, s."""
        return self._stamps[0] if self._stamps else None

    @property
    def items(self) -> list[tuple[float, T]]:
        """All stamps (s) with their values, oldest first."""
        return list(zip(self._stamps, self._values, strict=True))

    def add(self, stamp: float, value: T) -> None:
        """Keep the value of the instant `stamp`, s."""
        stamps, values = self._stamps, self._values
        while stamps and stamps[-1] >= stamp:
            stamps.pop()
            values.pop()
        stamps.append(stamp)
        values.append(value)
        while stamps[0] < stamp - KEEP:
            stamps.popleft()
            values.popleft()

    def clear(self) -> None:
        """Forget all values: they do not go on where the next one begins."""
        self._stamps.clear()
        self._values.clear()

    def at(self, stamp: float) -> T | None:
        """The value of an instant; after the newest it is the newest one, before the first one that is kept there is none."""
        stamps, values = self._stamps, self._values
        if not stamps or stamp < stamps[0]:
            return None
        if stamp >= stamps[-1]:
            return values[-1]
        after = bisect_left(stamps, stamp)
        if stamps[after] == stamp:
            return values[after]
        share = (stamp - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
        return self._between(values[after - 1], values[after], share)


def pose_history() -> History[Pose2]:
    """Of poses: between two on the straight line, and by the shorter turn."""
    return History(_pose_between)


def attitude_history() -> History[Attitude]:
    """Of attitudes and heights: between two linearly."""
    return History(_attitude_between)


def started_over(before: tuple[float, float], after: tuple[float, float], passed: float) -> bool:
    """Whether odometry went from one place (m) to another within `passed` seconds farther than the robot can: it has started over."""
    return abs(after[0] - before[0]) + abs(after[1] - before[1]) > JUMP + FASTEST * max(0.0, passed)


def _pose_between(a: Pose2, b: Pose2, share: float) -> Pose2:
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), wrap(a.yaw + share * wrap(b.yaw - a.yaw)))


def _attitude_between(a: Attitude, b: Attitude, share: float) -> Attitude:
    # A quaternion and its opposite say the same: the way between two of them is the shorter one.
    near = b[0] if a[0] @ b[0] >= 0.0 else -b[0]
    return a[0] + share * (near - a[0]), a[1] + share * (b[1] - a[1])
