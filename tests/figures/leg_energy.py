"""How much energy a walk along a planned path will take: a law with three numbers that every walk makes better.

    E = a L + b T + c

with the length L of the path and the turning T along it, from the heading at its start to the heading at its goal. The numbers begin with what
is typical of the robot (`robot.model.power`), and are fitted to the walks that have been made by recursive least squares.

Who walks a route again remembers what it took: what the law does not know of, such as waiting for the way or slowing down between shelves, is
the same then. The robot itself decides by what is typical (`robot.planning.energy`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, wrap_all
from robot.model.power import HOUR, electrical_power, typical_motor_power

_TURN_RATE = 1.0
"""At which the robot turns on the spot, rad/s."""
_REST = 2.0
"""Seconds of stepping in place at the beginning and at the end of a walk together."""
_TRUST = (0.3, 0.3, 1.0)
"""How far a, b and c may be off before the first walk, as a share of what they begin with; chosen."""
_NOISE = 0.01
"""What a walk takes more or less than the law says, as a share of it; chosen."""
_FORGET = 0.95
"""Share of what is known that a walk leaves to the next: the floor, the load and the drives' warmth change; chosen."""
_LEAST = 0.05
"""Wh: a walk shorter than that counts as this long."""
_BEND = 0.3
"""Points of a path nearer to each other than this say nothing of where it turns, m."""
_SAME, _SAME_TURN = 0.5, 0.5
"""Walks that begin and end within this of each other, m and rad, go by one route,"""
_SAME_LENGTH = 0.1
"""if their paths differ by no more than this share."""
_NEWEST = 0.3
"""Share of the latest walk in what is remembered of a route, once it was walked more often; chosen."""


def turning(start: Pose2, points: Floats, goal_yaw: float) -> float:
    """By how much a robot turns that stands at `start`, walks along `points`, shape (n, 2), in m, and then turns to `goal_yaw`, rad."""
    way = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - way[-1])) >= _BEND:
            way.append(point)
    steps = np.diff(np.array(way), axis=0)
    if not len(steps):
        return abs(wrap(goal_yaw - start.yaw))
    courses = np.concatenate(([start.yaw], np.arctan2(steps[:, 1], steps[:, 0]), [goal_yaw]))
    return float(np.abs(wrap_all(np.diff(courses))).sum())


class LegEnergy:
    """The three numbers, and how sure they are. Energies are those that the battery gives, in Wh."""

    def __init__(self, speed: float) -> None:
        walking, stepping, spinning = (
            electrical_power(typical_motor_power(vx, 0.0, wz, walking=True)) / HOUR
            for vx, wz in ((speed, 0.0), (0.0, 0.0), (0.0, _TURN_RATE))
        )
        self._law = np.array([walking / speed, spinning / _TURN_RATE, stepping * _REST])
        self._doubt = np.diag((np.array(_TRUST) * self._law) ** 2)

    def __repr__(self) -> str:
        a, b, c = self._law.tolist()
        return f"<LegEnergy: {a:.4f} Wh/m, {b:.4f} Wh/rad, {c:.4f} Wh>"

    def predict(self, length: float, turn: float) -> float:
        """What a walk of `length` m with `turn` rad will take, Wh."""
        return float(self._law @ (length, turn, 1.0))

    def learn(self, length: float, turn: float, energy: float) -> None:
        """Such a walk has taken so much, Wh."""
        row = np.array([length, turn, 1.0])
        noise = (_NOISE * max(energy, _LEAST)) ** 2
        self._doubt = self._doubt / _FORGET
        gain = self._doubt @ row / (row @ self._doubt @ row + noise)
        self._law = self._law + gain * (energy - row @ self._law)
        self._doubt = self._doubt - np.outer(gain, row @ self._doubt)


@dataclass(slots=True)
class _Route:
    """Where it begins and ends, and what its walks were like."""

    start: Pose2
    goal: Pose2
    length: float
    turn: float
    energy: float
    walks: int = 1

    def fits(self, start: Pose2, goal: Pose2, length: float) -> bool:
        """Whether another walk goes by this route."""
        ends = _alike(self.start, start) and _alike(self.goal, goal)
        return ends and abs(length - self.length) <= _SAME_LENGTH * self.length

    def again(self, length: float, turn: float, energy: float) -> None:
        """It was walked again."""
        self.walks += 1
        share = max(_NEWEST, 1.0 / self.walks)
        self.length += share * (length - self.length)
        self.turn += share * (turn - self.turn)
        self.energy += share * (energy - self.energy)


class RouteEnergy:
    """The law, and a memory of the routes that were walked. Energies are those that the battery gives, in Wh."""

    def __init__(self, speed: float) -> None:
        self._law = LegEnergy(speed)
        self._routes: list[_Route] = []

    def __repr__(self) -> str:
        return f"<RouteEnergy: {len(self._routes)} routes, {self._law!r}>"

    def predict(self, start: Pose2, goal: Pose2, length: float, turn: float) -> float:
        """What a walk from `start` to `goal` will take, whose path has a length of `length` m and turns by `turn` rad, Wh."""
        by_law, route = self._law.predict(length, turn), self._known(start, goal, length)
        if route is None:
            return by_law
        return route.energy + by_law - self._law.predict(route.length, route.turn)

    def learn(self, start: Pose2, goal: Pose2, length: float, turn: float, energy: float) -> None:
        """Such a walk has taken so much, Wh."""
        self._law.learn(length, turn, energy)
        route = self._known(start, goal, length)
        if route is None:
            self._routes.append(_Route(start, goal, length, turn, energy))
        else:
            route.again(length, turn, energy)

    def _known(self, start: Pose2, goal: Pose2, length: float) -> _Route | None:
        return next((route for route in self._routes if route.fits(start, goal, length)), None)


def _alike(a: Pose2, b: Pose2) -> bool:
    return hypot(a.x - b.x, a.y - b.y) < _SAME and abs(wrap(a.yaw - b.yaw)) < _SAME_TURN
