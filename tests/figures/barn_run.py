"""One walk through one BARN world, by the robot's own gait, estimator and navigator, with the truth in nobody's hands but the judge's.

The robot knows nothing of the world: its map begins empty, in a frame that starts under it, and holds what its LiDAR has seen. Where it is, it
knows from legs and IMU alone.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, hypot
from typing import Literal

import numpy as np

from robot.control.gait_controller import GaitController
from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2, Twist2
from robot.model.actuators import MOTOR_DELAY
from robot.model.modes import Mode
from robot.model.parameters import SIT_HEIGHT, STAND_HEIGHT
from robot.navigation.motion import Motion, State
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from tests.figures.barn_sight import Level, Leveled, Sight
from tests.figures.barn_worlds import BarnWorld
from tests.figures.fidelity import IDEAL, Fidelity
from tests.figures.unmapped import SHEET, WALKING, Tuning, unmapped_navigator

Backend = Literal["physics", "kinematic"]
Ended = Literal["success", "collision", "fall", "time-out", "gave up"]

LIMIT = 100.0
"""Seconds after which a run ends."""
PERIOD = 0.005
"""Of gait control, s."""
STEER = 10
"""Gait steps between two steps of the navigator (20 Hz)."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one run ended."""

    world: int
    seed: int
    ended: Ended
    seconds: float
    """From the goal to the end, in simulated time."""
    score: float
    """Success x OT / clip(seconds, 2 OT, 8 OT): at most 0.5."""
    touched: str = ""
    """What the robot ran into."""


def score(world: BarnWorld, seconds: float) -> float:
    """Of a success after so many seconds, by the rule of 2023 and later."""
    best = world.optimal_time
    return best / min(max(seconds, 2.0 * best), 8.0 * best)


class Walk:
    """One robot in one world; `steps` walks it."""

    def __init__(
        self,
        world: BarnWorld,
        backend: Backend,
        seed: int,
        tuning: Tuning | None = None,
        fidelity: Fidelity = IDEAL,
    ) -> None:
        self.world = world
        self._tuning = tuning or (SHEET if backend == "kinematic" else WALKING)
        self.body: Simulation
        self._drive: KinematicBody | None = None
        if backend == "kinematic":
            self.body = self._drive = KinematicBody(world.scene, seed=seed, sensors=fidelity.errors)
        else:
            self.body = PhysicsBody(
                world.scene, seed=seed, delay=MOTOR_DELAY, sensors=fidelity.errors, actuators=fidelity.drives
            )
        self._sight: Sight = Level(self.body) if fidelity.errors.lidar.sweep == 0.0 else Leveled(self.body)
        self.gait = GaitController(motor_delay=MOTOR_DELAY, own_feet=backend == "physics")
        start, goal = world.scene.start, world.goal
        away = hypot(goal.x - start.x, goal.y - start.y)
        bearing = atan2(goal.y - start.y, goal.x - start.x) - start.yaw
        self._goal_from_start = (away, bearing)
        self.ended: Ended | None = None
        self.touched = ""
        self.seconds = 0.0
        self._ticks = 0

    def pose(self) -> Pose2:
        """Where the robot believes to be, in its own frame."""
        state = self.gait.state
        w, x, y, z = state.quaternion.tolist()
        yaw = yaw_of(w, x, y, z)
        return Pose2(float(state.position[0]), float(state.position[1]), yaw)

    def velocity(self) -> Twist2:
        """What it believes its velocity to be, in body axes."""
        state = self.gait.state
        return Twist2(float(state.velocity[0]), float(state.velocity[1]), float(state.angular_velocity[2]))

    def steps(self) -> Iterator[Motion]:
        """Stand up, take the goal, and walk until something ends the run; yields every answer of the navigator."""
        self._stand_up()
        if self.ended is not None:
            return
        here = self.pose()
        away, bearing = self._goal_from_start
        goal = Pose2(
            here.x + away * np.cos(here.yaw + bearing), here.y + away * np.sin(here.yaw + bearing), here.yaw + bearing
        )
        navigator = unmapped_navigator(here, goal, self.world.goal_radius, self._tuning)
        navigator.set_goal(goal)
        begun = self._ticks
        while self.ended is None:
            tick = self._ticks - begun
            if tick % STEER == 0:
                scan, taken_at = self._sight.look(tick)
                motion = navigator.step(tick * PERIOD, self.pose(), self.velocity(), scan, taken_at)
                self.gait.command(motion.vx, motion.vy, motion.wz)
                yield motion
                if motion.state is State.FAILED:
                    self.ended = "gave up"
            self._step()
            self.seconds = (self._ticks - begun) * PERIOD
            self._judge()

    def _stand_up(self) -> None:
        self.gait.request(Mode.WALK)
        while self.gait.mode != Mode.WALK and self.ended is None:
            self._step()
            if self._ticks * PERIOD > 10.0 or self.body.truth().fallen:
                self.ended = "fall"

    def _step(self) -> None:
        targets = self.gait.step(PERIOD, self.body.imu(), self.body.joints())
        self._sight.moved(self.body.time, self.gait.state)
        if self._drive is None:
            self.body.command(targets)
        else:
            height = SIT_HEIGHT if self.gait.goal == Mode.SIT else STAND_HEIGHT
            self._drive.drive(*self.gait.velocity_command, height, self.gait.goal)
        self._ticks += 1
        self.body.advance(self._ticks * PERIOD)

    def _judge(self) -> None:
        """The only one who looks at the truth."""
        truth, goal = self.body.truth(), self.world.goal
        x, y, _ = truth.position.tolist()
        if truth.touching:
            self.ended, self.touched = "collision", truth.touching[0]
        elif truth.fallen:
            self.ended = "fall"
        elif hypot(x - goal.x, y - goal.y) <= self.world.goal_radius:
            self.ended = "success"
        elif self.seconds >= LIMIT:
            self.ended = "time-out"


def run(
    world: BarnWorld, backend: Backend, seed: int, tuning: Tuning | None = None, fidelity: Fidelity = IDEAL
) -> Outcome:
    """Walk through `world` once; without `tuning` with the numbers that go with the body."""
    walk = Walk(world, backend, seed, tuning, fidelity)
    deque(walk.steps(), maxlen=0)
    walk.body.close()
    ended: Ended = walk.ended or "gave up"
    points = score(world, walk.seconds) if ended == "success" else 0.0
    return Outcome(world.index, seed, ended, walk.seconds, points, walk.touched)
