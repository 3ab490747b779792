"""Threading the body through gaps: a short plan in place and heading, for where the middle's path alone does not tell how to turn.

A robot twice as long as wide fits through many gaps in one heading only. So ahead of the robot the floor is cut into cells of 10 cm
with 16 headings each (6 cm and 32 where that finds nothing good), and the quickest sequence of steps forward, backward, sideways and
turns is found that keeps the whole outline clear. The price of a step is the seconds it takes, more where it is close.
Equations and sources: docs/concepts/control.md#gap-planning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.navigation.limits import Limits
from robot.navigation.local_field import LocalField
from robot.planning.path import Path
from robot.planning.wavefront import Nodes, spread

_AVERSION = 4.0
"""A step at the least clearance costs so many times its seconds more; chosen."""
_UNSEEN = 1.3
"""Backward and sideways cost so many times their seconds: the path is meant to be walked forward; chosen."""
_CLOSE = 0.15
"""So near to the target a plan may end, m; chosen: more than the diagonal of a coarse cell."""
_LAST = 0.3
"""The target's heading is that of the last piece of the path before it, so long, m; chosen."""
_AT_END = 1e-6
"""Of the path: rounding, m."""
_NO_SPEED = 1e-3
"""What speeds are divided by at least, m/s: some bodies do not walk sideways or backward."""
_AHEAD = 1.6
"""How far along the path the plan ends, m."""
_REACH = 1.4
"""Half side of the square that is planned in, m. Its middle lies half-way to the target; all of it is within a `LocalField`."""


@dataclass(frozen=True, slots=True)
class _Fineness:
    """How finely places and headings are cut."""

    cell: float
    """m."""
    headings: int
    keep: float
    """No pose nearer than this to anything, m."""
    ease: float
    """From this on a step costs only its time, m."""

    @property
    def turn(self) -> float:
        """Angle between neighboring headings, rad."""
        return 2 * math.pi / self.headings


_COARSE, _FINE = _Fineness(0.10, 16, 0.05, 0.25), _Fineness(0.06, 32, 0.02, 0.15)
"""The second for where the first finds nothing good; it takes six times as long."""
_SLOWEST = 0.3
"""A way that is slower than this asks for a finer look, m/s."""


def plan_through_gap(
    pose: Pose2, path: Path, along: float, goal: Pose2, around: LocalField, limits: Limits
) -> Floats | None:
    """Poses (n, 3) from here to a point of the path 1.6 m ahead (or its end), or None when the body does not get there.

    The poses lie at most 22 cm or 22.5 degrees apart; the first is the robot's own.
    """
    end = min(along + _AHEAD, path.length)
    x, y = path.at(end)
    if end >= path.length - _AT_END:
        heading = goal.yaw
    else:
        before = path.at(end - _LAST)
        heading = math.atan2(y - before[1], x - before[0])
    target = Pose2(x, y, heading)
    coarse = _Lattice(pose, target, around, limits, _COARSE)
    poses, seconds = coarse.poses_to(target, math.pi / 4)
    if seconds > _AHEAD / _SLOWEST:
        # It found nothing, or backs off to turn round: a finer look may find the way straight on.
        finer, fewer = _Lattice(pose, target, around, limits, _FINE).poses_to(target, math.pi / 4)
        poses, seconds = (finer, fewer) if fewer < seconds else (poses, seconds)
    # Out of a dead end there may be no room to turn round: then backward, or sideways.
    return coarse.poses_to(target, math.pi)[0] if poses is None else poses


def _step(angle: float) -> tuple[int, int]:
    """(columns, rows) of the step, at most 3 cells long, whose direction is nearest to the angle."""
    near = [(a, b) for a in range(-2, 3) for b in range(-2, 3) if math.gcd(a, b) == 1]
    return min(near, key=lambda step: abs(wrap(math.atan2(step[1], step[0]) - angle)))


class _Lattice:
    """The states around one pose: index = (heading * rows + row) * columns + column, with a closed rim of two cells."""

    def __init__(self, pose: Pose2, target: Pose2, around: LocalField, limits: Limits, fineness: _Fineness) -> None:
        self._pose, self._fineness = pose, fineness
        half = math.ceil(_REACH / fineness.cell)
        self._side = side = 2 * half + 1
        self._layer = side * side
        line: Floats = (np.arange(side, dtype=np.float64) - half) * fineness.cell
        # The middle lies whole cells from the robot, so that its own place is one of them.
        right, up = (round((b - a) / 2 / fineness.cell) for a, b in ((pose.x, target.x), (pose.y, target.y)))
        self._x, self._y = pose.x + right * fineness.cell + line, pose.y + up * fineness.cell + line
        clear = self._clearances(around)
        closed = clear < fineness.keep
        # Where it already stands too near to something it may begin, but not come back to.
        self._start = self._index(half - up, half - right, round(pose.yaw / fineness.turn) % fineness.headings)
        closed.reshape(-1)[self._start] = False
        missing = np.clip((fineness.ease - clear) / (fineness.ease - fineness.keep), 0.0, 1.0)
        self._price = np.where(closed, np.inf, 1.0 + _AVERSION * missing * missing).reshape(-1)
        self._offsets, seconds = self._moves(limits)
        ends = np.arange(self._price.size)[:, None] + np.repeat(self._offsets, self._layer, axis=0)
        self._edges = np.repeat(seconds, self._layer, axis=0) * self._price[ends % self._price.size]
        self._edges[np.isinf(self._price)] = np.inf
        self._smallest = float(seconds.min())

    def _index(self, row: int, column: int, heading: int) -> int:
        return (heading * self._side + row) * self._side + column

    def _clearances(self, around: LocalField) -> Floats:
        """Of the body in every state, shape (headings, rows, columns); the rim is closed."""
        turn, count = self._fineness.turn, self._fineness.headings
        x, y = np.meshgrid(self._x, self._y)
        # A rectangle around the origin looks the same from behind.
        distinct = count // 2 if around.footprint.ahead == 0.0 else count
        clear = np.stack([around.body_clearance(x, y, np.full(x.shape, k * turn)) for k in range(distinct)])
        clear = np.concatenate([clear] * (count // distinct))
        clear[:, :2], clear[:, -2:], clear[:, :, :2], clear[:, :, -2:] = -1.0, -1.0, -1.0, -1.0
        return clear

    def _moves(self, limits: Limits) -> tuple[Nodes, Floats]:
        """Offsets and seconds of the eight moves in every heading, both of shape (headings, 8)."""
        count, cell, turn = self._fineness.headings, self._fineness.cell, self._fineness.turn
        offsets = np.zeros((count, 8), dtype=np.intp)
        seconds = np.zeros((count, 8))
        for k in range(count):
            right, up = _step(k * turn)
            side_right, side_up = -up, right
            forward, sideways = up * self._side + right, side_up * self._side + side_right
            length = math.hypot(right, up) * cell
            left, back = (((k + by) % count - k) * self._layer for by in (1, -1))
            offsets[k] = (forward, -forward, sideways, -sideways, left, back, forward + left, forward + back)
            ahead, side = length / limits.vx_max, length / max(limits.vy_max, _NO_SPEED)
            behind, turning = length / max(-limits.vx_min, _NO_SPEED), turn / limits.wz_max
            curve = max(ahead, turning)
            seconds[k] = (ahead, _UNSEEN * behind, _UNSEEN * side, _UNSEEN * side, turning, turning, curve, curve)
        return offsets, seconds

    def poses_to(self, target: Pose2, facing: float) -> tuple[Floats | None, float]:
        """The quickest poses to within 15 cm and `facing` (rad) of the target, and their price in seconds; None and inf without any."""
        x, y = np.meshgrid(self._x, self._y)
        near = np.hypot(x - target.x, y - target.y) <= _CLOSE
        turn, count = self._fineness.turn, self._fineness.headings
        turned = np.array([abs(wrap(k * turn - target.yaw)) <= facing for k in range(count)])
        targets = (near[None] & turned[:, None, None]).reshape(-1)

        def beside(now: Nodes) -> Nodes:
            return (now[:, None] + self._offsets[now // self._layer]) % self._price.size

        reached, costs, origin = spread(self._edges, beside, self._start, targets, self._smallest)
        if reached is None:
            return None, math.inf
        nodes = [reached]
        while nodes[-1] != self._start:
            nodes.append(int(origin[nodes[-1]]))
        states = np.array(nodes[::-1])
        heading, cell = np.divmod(states, self._layer)
        row, column = np.divmod(cell, self._side)
        yaw = np.unwrap(heading.astype(np.float64) * turn)
        poses: Floats = np.column_stack([self._x[column], self._y[row], yaw])
        poses[:, 2] += 2 * math.pi * round((self._pose.yaw - poses[0, 2]) / (2 * math.pi))
        poses[0] = (self._pose.x, self._pose.y, self._pose.yaw)
        return poses, float(costs[reached])
