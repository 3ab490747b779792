"""What `python -m tests.figures arm` measures, each a function of a seed."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import lru_cache
from math import cbrt, hypot, pi, sqrt
from typing import Literal

import numpy as np

from robot.control.gait_controller import GaitController
from robot.geometry.vectors import Vector
from robot.model.actuators import MOTOR_DELAY
from robot.model.arm import JOINTS, LIMITS, STOWED, forward, inverse
from robot.model.modes import Mode
from robot.planning.trajectory import ARM_LIMITS, Quintic, Stop
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.testing import FLAT, PERIOD

Backend = Literal["physics", "kinematic"]
Kind = Literal["speed", "acceleration", "jerk"]

POSES, MOTIONS = 5000, 100
RATE = 1000
"""Looks at a motion per second."""


def tip_error(seed: int) -> float:
    """Largest |FK(IK(p)) - p| over random reachable tips, m."""
    return max(_tip_and_angle(seed)[0])


def angle_error(seed: int) -> float:
    """Largest |IK(FK(q)) - q| over random angles whose tip the arm faces, rad."""
    return max(_tip_and_angle(seed)[1])


@lru_cache(maxsize=8)
def _tip_and_angle(seed: int) -> tuple[list[float], list[float]]:
    random = np.random.default_rng([seed, 41])
    tips, angles = [0.0], [0.0]
    for q in _angles(random, POSES).tolist():
        tip = forward(q)
        answer = inverse(tip)
        again = forward(answer)
        tips.append(hypot(again.x - tip.x, again.y - tip.y, again.z - tip.z))
        # away from full stretch and the axis, where an angle is only known to the root of a rounding, and not over the back
        if 0.05 < q[2] < pi - 0.05 and _faces(q):
            angles.append(max(abs(a - b) for a, b in zip(answer, q, strict=True)))
    return tips, angles


def _faces(q: list[float]) -> bool:
    straight = forward((0.0, *q[1:]))
    return straight.x > 0.01 and abs(q[0]) < LIMITS[0][1] - 0.6


def limit_share(seed: int, kind: Kind) -> float:
    """The largest share of a joint's limit of that kind that random motions use, a third of them cancelled half-way; 1.0 is the limit."""
    return _shares(seed)[kind]


def stopping_time(seed: int) -> float:
    """The longest time from a cancel to rest, s."""
    return _shares(seed)["stop"]


@lru_cache(maxsize=8)
def _shares(seed: int) -> dict[str, float]:
    random = np.random.default_rng([seed, 42])
    worst = {"speed": 0.0, "acceleration": 0.0, "jerk": 0.0, "stop": 0.0}
    for number, (start, target) in enumerate(_pairs(random, MOTIONS)):
        motion = Quintic.between(start, target)
        pieces: list[tuple[Quintic | Stop, float]] = [(motion, motion.duration)]
        if number % 3 == 0:
            until = float(random.uniform(0.0, motion.duration))
            stop = Stop(motion.at(until))
            pieces = [(motion, until), (stop, stop.duration)]
            worst["stop"] = max(worst["stop"], stop.duration)
        for piece, seconds in pieces:
            points = [piece.at(i / RATE) for i in range(int(seconds * RATE) + 1)]
            velocity = np.array([point.velocity for point in points])
            acceleration = np.array([point.acceleration for point in points])
            worst["speed"] = max(worst["speed"], float((np.abs(velocity) / ARM_LIMITS.speed).max()))
            worst["acceleration"] = max(
                worst["acceleration"], float((np.abs(acceleration) / ARM_LIMITS.acceleration).max())
            )
            if len(points) > 1:
                jerk = np.diff(acceleration, axis=0) * RATE
                worst["jerk"] = max(worst["jerk"], float((np.abs(jerk) / ARM_LIMITS.jerk).max()))
    return worst


def duration_ratio(seed: int) -> float:
    """Mean duration of random motions, as a multiple of the shortest that the limits allow."""
    random = np.random.default_rng([seed, 43])
    pairs = _pairs(random, 10 * MOTIONS)
    return float(np.mean([Quintic.between(a, b).duration / _shortest(np.abs(b - a)) for a, b in pairs]))


def _shortest(travel: Vector) -> float:
    """Of all joints from rest to rest, each by itself with speed, acceleration and jerk limited: the longest, s."""
    rows = zip(travel.tolist(), *(limit.tolist() for limit in ARM_LIMITS), strict=True)
    return max(_shortest_of_one(*row) for row in rows)


def _shortest_of_one(way: float, v: float, a: float, j: float) -> float:
    """The seven-segment profile and its short forms; v j >= a a holds for all joints, so acceleration is at its limit before speed is."""
    if way >= v * (v / a + a / j):
        return way / v + v / a + a / j
    if way >= 2.0 * a**3 / j**2:
        return a / j + sqrt((a / j) ** 2 + 4.0 * way / a)
    return 4.0 * cbrt(way / (2.0 * j))


def end_error(seed: int, backend: Backend) -> float:
    """The largest error of a joint half a second after the end of random motions, of a robot that stands, rad."""
    robot = Standing(seed, backend)
    random = np.random.default_rng([seed, 44])
    worst = 0.0
    for target in _angles(random, 12):
        # in front of the robot, where there is nothing to hit
        target = np.clip(target, (-1.5, -2.2, 0.3, -1.5), (1.5, 0.1, 2.6, 1.5))
        assert robot.body.arm is not None
        robot.run(robot.body.arm.move(target.tolist()) + 0.5)
        worst = max(worst, float(np.abs(robot.body.arm.state().position - target).max()))
    return worst


def walked_with_arm(seed: int, *, moving: bool) -> float:
    """The rms error of the speed held at 0.5 m/s for 8 s with the arm stowed, or with it moving from pose to pose all the time, m/s; inf after a fall."""
    robot = Standing(seed, "physics")
    poses = ((0.0, -0.8, 1.2, 0.3), (1.2, -0.5, 0.9, 0.0), (-1.2, -1.5, 1.2, 0.5), (0.0, -0.1, 0.2, 0.0))
    robot.gait.request(Mode.WALK)
    robot.gait.command(0.5, 0.0, 0.0)
    robot.run(3.0)
    places: list[Vector] = []
    for second in range(8):
        arm = robot.body.arm
        assert arm is not None
        if moving and not arm.state().moving:
            arm.move(poses[second % 4])
        places.append(robot.body.truth().position)
        robot.run(1.0)
        if robot.body.truth().fallen:
            return float("inf")
    places.append(robot.body.truth().position)
    steps: Vector = np.diff(np.array(places), axis=0)
    speeds = np.hypot(steps[:, 0], steps[:, 1])
    return float(np.sqrt(np.mean((speeds - 0.5) ** 2)))


class Standing:
    """A robot with an arm, standing; the kinematic one lies."""

    def __init__(self, seed: int, backend: Backend) -> None:
        self.body: Simulation = (
            PhysicsBody(FLAT, seed=seed, arm=True) if backend == "physics" else KinematicBody(FLAT, seed=seed, arm=True)
        )
        self.gait = GaitController(motor_delay=MOTOR_DELAY)
        self._steps = 0
        self.run(0.3)
        if backend == "kinematic":
            return  # what its arm does does not depend on how it stands
        self.gait.request(Mode.STAND)
        while self.gait.mode != Mode.STAND and self._steps < 2000:
            self.run(PERIOD)

    def run(self, seconds: float) -> None:
        """Let so much time pass under control."""
        for _ in range(max(1, round(seconds / PERIOD))):
            if self.body.backend == "physics":
                self.body.command(self.gait.step(PERIOD, self.body.imu(), self.body.joints()))
            self._steps += 1
            self.body.advance(self._steps * PERIOD)


def _angles(random: np.random.Generator, count: int) -> Vector:
    """Random joint angles within the limits, shape (count, 4)."""
    low, high = np.array(LIMITS).T
    return random.uniform(low, high, (count, len(JOINTS)))


def _pairs(random: np.random.Generator, count: int) -> list[tuple[Vector, Vector]]:
    """Starts and targets: long ways and short ones, and some from where the arm is stowed."""
    starts, targets = _angles(random, count), _angles(random, count)
    shares = random.choice((1.0, 0.3, 0.03), count)
    low, high = np.array(LIMITS).T
    pairs: list[tuple[Vector, Vector]] = []
    for number, (start, target, share) in enumerate(zip(starts, targets, shares, strict=True)):
        begin = np.array(STOWED) if number % 10 == 0 else start
        pairs.append((begin, np.clip(begin + share * (target - begin), low, high)))
    return pairs


@dataclass(frozen=True, slots=True)
class Delivery:
    """How one cup was fetched and carried."""

    success: bool
    seconds: float
    """Simulated, from the goal to its end."""
    off: float
    """How far from its place the cup stands in the end, m; inf if it was not put there."""


@lru_cache(maxsize=32)
def carried(seed: int, backend: Backend) -> Delivery:
    """The whole robot fetches a cup from somewhere on its table, and puts it on the other one. It knows only about where the cup is."""
    from actors import execute

    return execute(lambda: _carry(seed, backend), clock="virtual")


async def _carry(seed: int, backend: Backend) -> Delivery:
    from actors import Child, GoalFailed, Node, run
    from actors.interfaces.builtin_interfaces.msg import Time
    from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
    from robot.contracts import FETCH_AND_CARRY
    from robot.geometry.messages import pose_stamped
    from robot.geometry.planar import Pose2
    from robot.interfaces.robactor_msgs.action import FetchAndCarry
    from robot.scenes.kitchen import OTHER_TABLE, kitchen
    from robot.sim.battery import Pack
    from robot.tree import robot_tree

    random = np.random.default_rng([seed, 45])
    cup = (2.05 + float(random.uniform(-0.09, 0.09)), 1.0 + float(random.uniform(-0.09, 0.09)))
    place = (OTHER_TABLE.x + float(random.uniform(-0.06, 0.06)), OTHER_TABLE.y + float(random.uniform(-0.06, 0.06)))
    scene = kitchen(cup)
    body: Simulation = (
        PhysicsBody(scene, seed=seed, arm=True) if backend == "physics" else KinematicBody(scene, seed=seed, arm=True)
    )
    tree = robot_tree(body, Pack(90.0), None)
    on_table = Point(x=place[0], y=place[1], z=OTHER_TABLE.height)
    target = PoseStamped(pose=Pose(position=on_table))
    goal = FetchAndCarry.Goal(object_name="cup", target_pose=pose_stamped(Pose2(2.05, 1.0), Time()), place_pose=target)
    async with run(tree, seed=seed, sinks=()) as system:
        judge = (await system.join(Child(Node, name="judge"))).node
        await system.clock.sleep(1.0)
        begun = system.clock.now()
        success = True
        try:
            async with judge.send_goal(FETCH_AND_CARRY, goal) as handle:
                await handle
        except GoalFailed as failed:
            print(f"seed {seed}, {backend}: {failed}", file=sys.stderr)
            success = False
        taken = system.clock.now() - begun
        await system.clock.sleep(1.0)
        (thing, *_), fallen = body.things(), body.truth().fallen
        off = hypot(thing.shape.x - place[0], thing.shape.y - place[1])
        stands = abs(thing.z - OTHER_TABLE.height) < 0.01
    return Delivery(success and stands and not fallen, taken, off if stands else float("inf"))
