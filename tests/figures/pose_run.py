"""One patrol of the whole robot in physics, and how far its pose on the map was from the truth meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import degrees, hypot
from typing import TypeAlias

import numpy as np

from actors import Child, Node, execute, run
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.std_msgs.msg import String
from robot.contracts import LOCALIZATION, POSE
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose
from robot.run.judge import Judge, Score
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.tree import robot_tree
from tests.figures.fidelity import Fidelity

Seen: TypeAlias = tuple[float, float, float, float]
"""Of one pose: the error in place (m) and heading (rad), and the true place (m)."""

GETTING_UP = 4.0
"""Seconds until the robot walks: the localizer's first scans are not counted."""
_SWAY = 25
"""Poses from one place to the next that count as walking: half a second, which leaves sway out."""


@dataclass(frozen=True, slots=True)
class OnMap:
    """How far the pose on the map was from the truth."""

    seed: int
    poses: int
    """So many were compared."""
    place: float
    """rms, m."""
    worst: float
    """m."""
    heading: float
    """rms, degrees."""
    worst_heading: float
    """Degrees."""
    walked: float
    """m."""
    goals: int
    """Reached."""
    falls: int
    said: list[str]
    """What the localizer said of itself."""


@lru_cache(maxsize=64)
def patrol(seed: int, delay: float, seconds: float, fidelity: Fidelity, world: str = "warehouse") -> OnMap:
    """The whole robot on the patrol of its world, on the virtual clock: so many seconds, after it has got up. `delay` (s) is the motors'."""
    scene = get_world(world)
    body = PhysicsBody(scene, seed=seed, delay=delay, sensors=fidelity.errors, actuators=fidelity.drives)
    waypoints = [(f"patrol_{number}", pose) for number, pose in enumerate(scene.patrol, start=1)]
    tree = robot_tree(body, Pack(90.0), waypoints, motor_delay=delay)
    seen: list[Seen] = []
    said: list[str] = []
    score = Score()

    async def main() -> None:
        async with run(tree, seed=seed, sinks=()) as system:
            await system.join(Child(Judge, args=(body, score)))
            await system.clock.sleep(GETTING_UP)
            await system.join(Child(_Witness, args=(body, seen, said)))
            await system.clock.sleep(seconds)

    execute(main, clock="virtual")
    errors = np.array(seen)
    place, heading = np.sqrt(np.mean(np.square(errors[:, :2]), axis=0)).tolist()
    walked = float(np.linalg.norm(np.diff(errors[::_SWAY, 2:], axis=0), axis=1).sum())
    return OnMap(
        seed=seed, poses=len(errors), place=place, worst=float(errors[:, 0].max()),
        heading=degrees(heading), worst_heading=degrees(float(np.abs(errors[:, 1]).max())),
        walked=walked, goals=sum(goal.succeeded for goal in score.goals), falls=score.falls, said=said,
    )  # fmt: skip


class _Witness(Node):
    """Compares every pose with the true one of its instant."""

    def __init__(self, body: Simulation, seen: list[Seen], said: list[str]) -> None:
        self._body, self._seen, self._said = body, seen, said

    @POSE.on()
    def pose(self, message: PoseStamped) -> None:
        self._body.advance(self.clock.now())
        truth, told = self._body.truth(), from_pose(message.pose)
        x, y, _ = truth.position.tolist()
        self._seen.append((hypot(told.x - x, told.y - y), wrap(told.yaw - truth.yaw), x, y))

    @LOCALIZATION.on()
    def localization(self, message: String) -> None:
        self._said.append(message.data)
