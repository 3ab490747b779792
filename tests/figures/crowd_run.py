"""A robot with goals among people who walk about, in physics, and who caused it when the two touched."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import hypot, pi
from typing import Any, Final

import numpy as np

from actors import Child, execute, run
from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2
from robot.hardware.sensors import SensorKind, Sensors
from robot.run.judge import Judge, Score
from robot.scenes.scene import Box, Cylinder, Scene, Walker
from robot.sim.battery import Pack
from robot.sim.physics import PhysicsBody
from robot.tree import robot_tree
from tests.figures.encounters import Contact, Encounters

WALKERS: Final = 10
_SIDE: Final = 14.0
"""Of the hall, m."""
_SLOWEST, _FASTEST = 0.5, 1.5
"""Of the people, m/s."""
_RADIUS, _HEIGHT = 0.25, 1.75
_PLACES, _GOALS = 200, 100
_APART: Final = 5.0
"""From one goal to the next, m."""
NEAR_ENOUGH: Final = {"position_tolerance": 0.25, "yaw_tolerance": 0.25}
"""A goal is reached from so near, m and rad: nav2's tolerances. Somebody may stand on it."""
PATIENCE: Final = 60.0
"""A goal that has been under way for longer when a trial ends was not reached, s; others are not counted."""


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
        return sum(Contact(**contact).caused for contact in self.contacts)


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


class CrowdBody(PhysicsBody):
    """Tells its encounters of every touch at every physics step."""

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        self.encounters = Encounters()

    def _step(self, ticks: int) -> None:
        super()._step(ticks)
        x, y = self._qpos[:2].tolist()
        self.encounters.see(self.time, Pose2(x, y, yaw_of(*self._qpos[3:7].tolist())))
        if not self._data.ncon:
            return
        for name in self._touching(self._contacts()):
            if name.startswith("walker"):
                self.encounters.touch(name, *self._data.mocap_pos[int(name.partition("_")[2]), :2].tolist())


def walk(seed: int, seconds: float, *, sensors: SensorKind = "ideal") -> Outcome:
    """Walk from goal to goal among the people for so long."""
    scene, goals = hall(seed)
    body = CrowdBody(scene, seed=seed, sensors=Sensors.of(sensors))
    waypoints = [(f"goal_{number}", pose) for number, pose in enumerate(goals, start=1)]
    tree = robot_tree(body, Pack(100.0), waypoints, sight=True)
    score = Score()

    async def main() -> None:
        async with run(tree, seed=seed, sinks=(), parameters={"/navigation": NEAR_ENOUGH}) as system:
            await system.join(Child(Judge, args=(body, score)))
            while system.clock.now() < seconds and score.falls == 0:
                await system.clock.sleep(0.1)

    execute(main, clock="virtual")
    reached, failures = (
        sum(goal.succeeded for goal in score.goals),
        [goal.reason for goal in score.goals if not goal.succeeded],
    )
    if body.time - max((goal.at for goal in score.goals), default=0.0) > PATIENCE:
        failures.append(f"not reached within {PATIENCE:g} s")
    return Outcome(
        seed, round(body.time, 1), reached + len(failures), reached, failures, score.falls,
        [asdict(contact) for contact in body.encounters.contacts], round(score.walked, 1),
    )  # fmt: skip
