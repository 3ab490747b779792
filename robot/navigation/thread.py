"""Threading the body through gaps: a short plan in place and heading, for where the middle's path alone does not tell how to turn.

A robot twice as long as wide fits through many gaps in one heading only. So around the robot the floor is cut into cells of 10 cm with
16 headings each, and the quickest sequence of steps forward, backward, sideways and turns is found that keeps the whole outline
clear. The price of a step is the seconds it takes, more where it is close.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robot.navigation.follow import Limits
from robot.navigation.path import Path, wrap
from robot.navigation.surroundings import Surroundings
from robot.navigation.wavefront import Nodes, spread
from robot.world.scene import Pose2

__all__ = ["thread"]

Floats = NDArray[np.float64]

_CELL = 0.1
_REACH = 2.3
"""Half side of the square that is planned in, m; within the square that `Surroundings` prepares."""
_HEADINGS = 16
_TURN = 2 * math.pi / _HEADINGS
_AHEAD = 1.8
"""How far along the path the plan ends, m."""
_STEPS = ((1, 0), (2, 1), (1, 1), (1, 2), (0, 1), (-1, 2), (-1, 1), (-2, 1), (-1, 0), (-2, -1), (-1, -1), (-1, -2), (0, -1), (1, -2), (1, -1), (2, -1))
"""(columns, rows) that a step in each heading goes: the nearest cell in that direction."""
_KEEP, _EASE = 0.05, 0.25
"""No pose nearer than the first to anything, m; from the second on a step costs only its time."""
_AVERSION = 4.0


def thread(pose: Pose2, path: Path, along: float, goal: Pose2, around: Surroundings, limits: Limits) -> Floats | None:
    """Poses (n, 3) from here to a point of the path some 1.8 m ahead (or its end), or None when the body does not get there.

    `around` must be centered on the pose. The poses lie at most 22 cm or 22.5 degrees apart; the first is the robot's own.
    """
    lattice = _Lattice(pose, around, limits)
    end = min(along + _AHEAD, path.length)
    x, y = path.at(end)
    if end >= path.length - 1e-6:
        heading = goal.yaw
    else:
        before = path.at(end - 0.3)
        heading = math.atan2(y - before[1], x - before[0])
    return lattice.poses_to(Pose2(x, y, heading))


class _Lattice:
    """The states around one pose: index = (heading * rows + row) * columns + column, with a closed rim of two cells."""

    def __init__(self, pose: Pose2, around: Surroundings, limits: Limits) -> None:
        self._pose = pose
        half = math.ceil(_REACH / _CELL)
        self._side = side = 2 * half + 1
        self._layer = side * side
        line = (np.arange(side) - half) * _CELL
        # Cells are centered on the robot, so that its own place is one of them.
        self._x, self._y = pose.x + line, pose.y + line
        clear = self._clearances(around)
        closed = clear < _KEEP
        # Where it already stands too near to something it may begin, but not come back to.
        self._start = self._index(half, half, round(pose.yaw / _TURN) % _HEADINGS)
        closed.reshape(-1)[self._start] = False
        missing = np.clip((_EASE - clear) / (_EASE - _KEEP), 0.0, 1.0)
        self._price = np.where(closed, np.inf, 1.0 + _AVERSION * missing * missing).reshape(-1)
        self._offsets, seconds = self._moves(limits)
        ends = np.arange(self._price.size)[:, None] + np.repeat(self._offsets, self._layer, axis=0)
        self._edges = np.repeat(seconds, self._layer, axis=0) * self._price[ends % self._price.size]
        self._edges[np.isinf(self._price)] = np.inf
        self._smallest = float(seconds.min())

    def _index(self, row: int, column: int, heading: int) -> int:
        return (heading * self._side + row) * self._side + column

    def _clearances(self, around: Surroundings) -> Floats:
        """Of the body in every state, shape (headings, rows, columns); the rim is closed."""
        x, y = np.meshgrid(self._x, self._y)
        half_turn = np.stack([around.body_clearance(x, y, np.full(x.shape, k * _TURN)) for k in range(_HEADINGS // 2)])
        clear = np.concatenate([half_turn, half_turn])  # a rectangle looks the same from behind
        clear[:, :2], clear[:, -2:], clear[:, :, :2], clear[:, :, -2:] = -1.0, -1.0, -1.0, -1.0
        return clear

    def _moves(self, limits: Limits) -> tuple[Nodes, Floats]:
        """Offsets and seconds of the eight moves in every heading, both of shape (headings, 8)."""
        offsets = np.zeros((_HEADINGS, 8), dtype=np.intp)
        seconds = np.zeros((_HEADINGS, 8))
        for k in range(_HEADINGS):
            right, up = _STEPS[k]
            forward = up * self._side + right
            side_right, side_up = _STEPS[(k + 4) % _HEADINGS]
            sideways = side_up * self._side + side_right
            length = math.hypot(right, up) * _CELL
            left, back = (((k + turn) % _HEADINGS - k) * self._layer for turn in (1, -1))
            offsets[k] = (forward, -forward, sideways, -sideways, left, back, forward + left, forward + back)
            turn = _TURN / limits.wz_max
            ahead, side = length / limits.vx_max, length / max(limits.vy_max, 1e-3)
            behind = length / max(-limits.vx_min, 1e-3)
            curve = max(ahead, turn)
            seconds[k] = (ahead, 1.3 * behind, 1.3 * side, 1.3 * side, turn, turn, curve, curve)
        return offsets, seconds

    def poses_to(self, target: Pose2) -> Floats | None:
        """The quickest poses to within 15 cm and 45 degrees of the target."""
        x, y = np.meshgrid(self._x, self._y)
        near = np.hypot(x - target.x, y - target.y) <= 0.15
        facing = np.array([abs(wrap(k * _TURN - target.yaw)) <= math.pi / 4 for k in range(_HEADINGS)])
        targets = (near[None] & facing[:, None, None]).reshape(-1)

        def beside(now: Nodes) -> Nodes:
            return (now[:, None] + self._offsets[now // self._layer]) % self._price.size

        reached, _, origin = spread(self._edges, beside, self._start, targets, self._smallest)
        if reached is None:
            return None
        nodes = [reached]
        while nodes[-1] != self._start:
            nodes.append(int(origin[nodes[-1]]))
        states = np.array(nodes[::-1])
        heading, cell = np.divmod(states, self._layer)
        row, column = np.divmod(cell, self._side)
        poses = np.column_stack([self._x[column], self._y[row], np.unwrap(heading * _TURN)])
        poses[:, 2] += 2 * math.pi * round((self._pose.yaw - poses[0, 2]) / (2 * math.pi))
        poses[0] = (self._pose.x, self._pose.y, self._pose.yaw)
        return poses
