"""A robot that is lifted, carried elsewhere and put down there: what it says of where it is, and whether that is so."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi
from typing import Final, Literal

import numpy as np

from actors import Child, Node, execute, run
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import LOCALIZATION, POSE, STAND
from robot.estimation.fit_watch import AMBIGUOUS, TRACKING
from robot.estimation.relocalize import Relocalizer, apart
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.actuators import MOTOR_DELAY
from robot.planning.grid import Grid
from robot.scenes.scene import Scene
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.tree import in_sight, robot_tree
from tests.figures.fidelity import Fidelity
from tests.figures.room_worlds import room

Ended = Literal["found", "alike", "lost", "wrong"]
"""It knows where it is; it says that several places are alike; it says that it is lost; it believes to be where it is not."""
PLACES: Final = ("warehouse", "pillars", "corridor", "kitchen", "room")
"""Worlds in which robots are carried; `room` is another one for each seed."""
STANDING: Final = 6.0
"""Seconds until a robot that was told to stand up stands still, and is carried."""
WITHIN: Final = 10.0
"""Seconds after which it is asked."""
_NEAR, _NEAR_TURN = 0.1, 0.1
"""m and rad: so near to the truth it knows where it is."""
_SAME: Final = 0.15
"""Two ranges that differ by less are the same, m."""
_TELLING: Final = 0.02
"""Share of the beams that must differ for two places to be told from each other."""
_SAID: Final[dict[str, Ended]] = {TRACKING: "wrong", AMBIGUOUS: "alike"}
_FREE: Final = 0.7
"""From a place to the nearest obstacle, m."""
_FAR: Final = 1.0
"""From where it stood, m."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How it went."""

    seed: int
    world: str
    x: float
    y: float
    yaw: float
    """Where it was put: m and rad."""
    alike: int
    """Other places of the world where a LiDAR sees the same."""
    ended: Ended
    seconds: float | None
    """From which on it knew where it was, after it was put down."""
    error: float
    """In the end, m."""
    said: str
    """What the localizer said of itself in the end."""
    fallen: bool


class CarriedBody(PhysicsBody):
    """A body that somebody can carry about."""

    def carry(self, there: Pose2) -> None:
        """Put the robot down elsewhere on the same floor, as it stands: its joints, its height and its lean stay as they are."""
        turn = wrap(there.yaw - self.truth().yaw)
        c, s = np.cos(turn), np.sin(turn)
        self._qpos[:2] = there.x, there.y
        half = np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)])
        self._mujoco.mju_mulQuat(self._qpos[3:7], half, self._qpos[3:7].copy())
        vx, vy = self._qvel[:2].tolist()
        self._qvel[:2] = c * vx - s * vy, s * vx + c * vy
        self._mujoco.mj_forward(self._model, self._data)


def place(seed: int, world: str) -> tuple[Scene, Pose2]:
    """A world, and a place in it where the robot can stand: both by the seed."""
    random = np.random.default_rng([seed, 31])
    if world == "room":
        found = room(seed)
        return found.scene, found.goals[int(random.integers(len(found.goals)))]
    scene = get_world(world)
    grid, start = Grid.from_scene(scene), scene.start
    while True:
        x, y = random.uniform(scene.bounds[:2], scene.bounds[2:]).tolist()
        cell = grid.cell(x, y)
        if cell is not None and grid.clearance[cell] >= _FREE and hypot(x - start.x, y - start.y) >= _FAR:
            return scene, Pose2(x, y, float(random.uniform(-pi, pi)))


def alike(scene: Scene, there: Pose2) -> int:
    """Other places of a world where the LiDAR of a standing robot, without any error, sees the same as `there`, but for one beam in fifty."""
    seeable = in_sight(scene)
    body = KinematicBody(seeable, seed=0, noise=False)

    def seen(pose: Pose2) -> Floats:
        body.place(pose)
        return body.lidar()

    here = seen(there)
    found = [one.pose for one in Relocalizer(Grid.from_scene(seeable)).search(here) if apart(one.pose, there)]
    return sum(float((np.abs(seen(pose) - here) > _SAME).mean()) < _TELLING for pose in found)


def carry(seed: int, world: str, fidelity: Fidelity) -> Outcome:
    """One robot in physics that stands at the start of a world, and is carried to a place in it."""
    scene, there = place(seed, world)
    body = CarriedBody(scene, seed=seed, delay=MOTOR_DELAY, sensors=fidelity.errors, actuators=fidelity.drives)
    tree = robot_tree(body, Pack(90.0), None, motor_delay=MOTOR_DELAY)
    seen = _Seen()

    async def main() -> None:
        async with run(tree, seed=seed, sinks=()) as system:
            await system.join(Child(_Witness, args=(body, seen)))
            await system.join(Child(Node, name="asker"))
            await system.node("asker").call(STAND, Trigger.Request())
            await system.clock.sleep(STANDING)
            body.advance(system.clock.now())
            body.carry(there)
            seen.known_since, carried = None, system.clock.now()
            await system.clock.sleep(WITHIN)
            if seen.known_since is not None:
                seen.known_since -= carried

    execute(main, clock="virtual")
    return Outcome(
        seed, world, round(there.x, 3), round(there.y, 3), round(there.yaw, 3), alike(scene, there), seen.ended,
        None if seen.known_since is None else round(seen.known_since, 2), round(seen.error, 3), seen.said, seen.fallen,
    )  # fmt: skip


@dataclass(slots=True)
class _Seen:
    """What a witness has seen so far."""

    known_since: float | None = None
    error: float = 0.0
    said: str = TRACKING
    fallen: bool = False

    @property
    def ended(self) -> Ended:
        """As what it counts if it ends now."""
        if self.known_since is not None:
            return "found"
        return _SAID.get(self.said, "lost")


class _Witness(Node):
    """Holds every pose against the true one of its instant."""

    def __init__(self, body: CarriedBody, seen: _Seen) -> None:
        self._body, self._seen = body, seen

    @POSE.on()
    def pose(self, message: PoseStamped) -> None:
        self._body.advance(self.clock.now())
        truth, told, seen = self._body.truth(), from_pose(message.pose), self._seen
        x, y, _ = truth.position.tolist()
        seen.error, seen.fallen = hypot(told.x - x, told.y - y), seen.fallen or truth.fallen
        known = seen.error < _NEAR and abs(wrap(told.yaw - truth.yaw)) < _NEAR_TURN and seen.said == TRACKING
        if not known:
            seen.known_since = None
        elif seen.known_since is None:
            seen.known_since = self.clock.now()

    @LOCALIZATION.on()
    def localization(self, message: String) -> None:
        self._seen.said = message.data
