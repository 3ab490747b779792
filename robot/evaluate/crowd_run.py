"""A robot with goals among people who walk about, in physics, and who caused it when the two touched."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import hypot, pi
from typing import Any, Final

import numpy as np

from actors import Child, execute, run
from robot.evaluate.watched import WatchedBody
from robot.geometry.planar import Pose2
from robot.run.judge import Judge, Score
from robot.scenes.scene import Box, Cylinder, Scene, Walker
from robot.sim.battery import Pack
from robot.tree import robot_tree

__all__ = ["WALKERS", "Outcome", "hall", "walk"]

WALKERS: Final = 10
_SIDE: Final = 14.0
"""Of the hall, m."""
_SLOWEST, _FASTEST = 0.5, 1.5
"""Of the people, m/s."""
_RADIUS, _HEIGHT = 0.25, 1.75
_PLACES, _GOALS = 200, 100
_APART: Final = 5.0
"""From one goal to the next, m."""
_RISING: Final = 4.0
"""Seconds until the robot walks."""
NEAR_ENOUGH: Final = {"position_tolerance": 0.25, "yaw_tolerance": 0.25}
"""A goal is reached from so near, m and rad: nav2's tolerances. Somebody may stand on it."""
_BEFORE: Final = 0.5
_TOWARDS: Final = 0.05
"""A contact is the robot's doing when it came towards the other faster than this, m/s, on average over any tenth of a second of the time
before, s."""
_TENTH: Final = 0.1
_AGAIN: Final = 1.0
"""A touch so soon after the last of the same person is the same contact, s."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How it went."""

    seed: int
    seconds: float
    goals: int
    """Asked for and ended."""
    reached: int
    failures: list[str]
    falls: int
    contacts: list[dict[str, Any]]
    """Who, when (s), and how fast the robot came towards it before (m/s)."""
    walked: float

    @property
    def caused(self) -> int:
        """Contacts that the robot caused."""
        return sum(contact["towards"] > _TOWARDS for contact in self.contacts)


def hall(seed: int) -> tuple[Scene, tuple[Pose2, ...]]:
    """A hall with a few pillars and ten people, and goals in it."""
    random = np.random.default_rng([seed, 10])
    walls = (
        *(Box(_SIDE / 2, y, _SIDE + 0.2, 0.1, height=2.0) for y in (-0.05, _SIDE + 0.05)),
        *(Box(x, _SIDE / 2, 0.1, _SIDE + 0.2, height=2.0) for x in (-0.05, _SIDE + 0.05)),
    )
    pillars = tuple(Box(x, y, 0.4, 0.4, height=2.0) for x in (4.0, 10.0) for y in (4.0, 10.0))
    start = Pose2(_SIDE / 2, _SIDE / 2)
    goals = [start]
    while len(goals) <= _GOALS:
        x, y = random.uniform(1.2, _SIDE - 1.2, 2).tolist()
        clear = all(hypot(x - one.x, y - one.y) > 1.2 for one in pillars)
        if clear and hypot(x - goals[-1].x, y - goals[-1].y) > _APART:
            goals.append(Pose2(x, y, float(random.uniform(-pi, pi))))
    people = tuple(_person(random, start) for _ in range(WALKERS))
    scene = Scene(f"crowd {seed}", (0.0, 0.0, _SIDE, _SIDE), (*walls, *pillars), start, start, walkers=people)
    return scene, tuple(goals[1:])


def _person(random: np.random.Generator, start: Pose2) -> Walker:
    """Somebody who goes from place to place, beginning away from the robot. People walk through pillars and each other: the robot does not."""
    way = [(float(x), float(y)) for x, y in random.uniform(0.4, _SIDE - 0.4, (_PLACES, 2))]
    first = next(one for one in way if hypot(one[0] - start.x, one[1] - start.y) > 2.0)
    speed = float(random.uniform(_SLOWEST, _FASTEST))
    return Walker(Cylinder(*first, _RADIUS, _HEIGHT), tuple(way), speed)


class CrowdBody(WatchedBody):
    """Writes down who was touched, and how fast the robot came towards them before."""

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        self.contacts: list[dict[str, Any]] = []
        self._been: deque[tuple[float, float, float]] = deque()
        self._last: dict[str, float] = {}

    def _step(self, ticks: int) -> None:
        super()._step(ticks)
        x, y = self._qpos[:2].tolist()
        self._been.append((self.time, x, y))
        while self._been[0][0] < self.time - _BEFORE - _TENTH:
            self._been.popleft()
        if not self._data.ncon:
            return
        for name in self._touching():
            if not name.startswith("walker"):
                continue
            if self.time - self._last.get(name, -_AGAIN) >= _AGAIN:
                towards = self._towards(int(name.partition("_")[2]))
                self.contacts.append({"who": name, "at": round(self.time, 2), "towards": round(towards, 3)})
            self._last[name] = self.time

    def _towards(self, index: int) -> float:
        """The highest speed (m/s) of the body towards a walker's present place, averaged over a tenth of a second."""
        place_x, place_y = self._data.mocap_pos[index, :2].tolist()
        been = np.array(self._been)
        gaps = np.hypot(been[:, 1] - place_x, been[:, 2] - place_y)
        later = np.searchsorted(been[:, 0], been[:, 0] + _TENTH)
        inside = later < len(been)
        first = np.flatnonzero(inside)
        if not len(first):
            return 0.0
        return float(((gaps[first] - gaps[later[first]]) / (been[later[first], 0] - been[first, 0])).max())


def walk(seed: int, seconds: float, *, sight: bool = True) -> Outcome:
    """Walk from goal to goal among the people for so long."""
    scene, goals = hall(seed)
    body = CrowdBody(scene, seed=seed)
    waypoints = [(f"goal_{number}", pose) for number, pose in enumerate(goals, start=1)]
    tree = robot_tree(body, Pack(100.0), waypoints, sight=sight)
    score = Score()

    async def main() -> None:
        async with run(tree, seed=seed, sinks=(), parameters={"/navigation": NEAR_ENOUGH}) as system:
            await system.join(Child(Judge, args=(body, score)))
            body.watch(after=_RISING)
            while system.clock.now() < seconds and score.falls == 0:
                await system.clock.sleep(0.1)
            body.watch(after=float("inf"))

    execute(main, clock="virtual")
    return Outcome(
        seed, round(body.time, 1), len(score.goals), sum(goal.succeeded for goal in score.goals),
        [goal.reason for goal in score.goals if not goal.succeeded], score.falls, body.contacts, round(score.walked, 1),
    )  # fmt: skip
