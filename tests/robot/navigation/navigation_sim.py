"""A body on wheels of thought for navigation tests: it obeys velocity commands with a lag, sees by rays, and knows when
it touches.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2, Twist2
from robot.navigation.motion import Motion, State
from robot.navigation.navigator import Navigator
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene
from robot.sim.lidar_rays import cast

LENGTH, WIDTH = 1.1, 0.5
LAG = 0.15
SLEW, TURN_SLEW = 1.5, 4.0


def _edge() -> NDArray[np.float64]:
    """Points every 2 cm along the outline, and some inside, in body axes."""
    x, y = np.arange(-LENGTH / 2, LENGTH / 2 + 1e-9, 0.02), np.arange(-WIDTH / 2, WIDTH / 2 + 1e-9, 0.02)
    sides = [(a, b) for a in x for b in (-WIDTH / 2, WIDTH / 2)] + [
        (a, b) for a in (-LENGTH / 2, LENGTH / 2) for b in y
    ]
    return np.array(sides + [(a, 0.0) for a in x])


_EDGE = _edge()


@lru_cache(maxsize=64)
def _columns(obstacles: tuple[Obstacle, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    boxes = [
        (o.x, o.y, math.cos(o.yaw), math.sin(o.yaw), o.length / 2, o.width / 2) for o in obstacles if isinstance(o, Box)
    ]
    posts = [(o.x, o.y, o.radius) for o in obstacles if isinstance(o, Cylinder)]
    return np.array(boxes).reshape(-1, 6), np.array(posts).reshape(-1, 3)


def body_clearance(scene: Scene, pose: Pose2) -> float:
    """Exact distance (m) from the body's outline to the scene's obstacles (boxes: to 1 cm); zero or less means contact."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    boxes, posts = _columns(scene.obstacles)
    dx, dy = posts[:, 0] - pose.x, posts[:, 1] - pose.y
    out_x, out_y = np.abs(c * dx + s * dy) - LENGTH / 2, np.abs(c * dy - s * dx) - WIDTH / 2
    gaps = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0)) - posts[:, 2]
    # Boxes: only those whose circle comes near, by points along the outline.
    far = np.hypot(boxes[:, 0] - pose.x, boxes[:, 1] - pose.y) - np.hypot(boxes[:, 4], boxes[:, 5])
    bx, by, bc, bs, half_l, half_w = (
        column[:, None] for column in boxes[far <= max(far.min(initial=9.0), 0.0) + 1.0].T
    )
    x = pose.x + c * _EDGE[:, 0] - s * _EDGE[:, 1] - bx
    y = pose.y + s * _EDGE[:, 0] + c * _EDGE[:, 1] - by
    out_x, out_y = np.abs(bc * x + bs * y) - half_l, np.abs(bc * y - bs * x) - half_w
    sides = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0)) + np.minimum(np.maximum(out_x, out_y), 0.0)
    return float(min(gaps.min(initial=math.inf), sides.min(initial=math.inf)))


@dataclass
class VelocityPlant:
    """The simulated body. `scene` may be replaced at any time, to drop a box or to move one."""

    scene: Scene
    pose: Pose2
    seed: int = 0
    lidar_sd: float = 0.015
    pose_sd: tuple[float, float] = (0.005, 0.005)
    velocity: Twist2 = field(default_factory=Twist2)
    time: float = 0.0

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)

    def advance(self, command: Twist2, seconds: float, dt: float = 0.01) -> None:
        for _ in range(round(seconds / dt)):
            v = self.velocity
            self.velocity = Twist2(
                *(
                    now + max(-slew, min(slew, (wanted - now) / LAG)) * dt
                    for wanted, now, slew in (
                        (command.vx, v.vx, SLEW),
                        (command.vy, v.vy, SLEW),
                        (command.wz, v.wz, TURN_SLEW),
                    )
                )
            )
            v, p = self.velocity, self.pose
            c, s = math.cos(p.yaw), math.sin(p.yaw)
            self.pose = Pose2(p.x + (c * v.vx - s * v.vy) * dt, p.y + (s * v.vx + c * v.vy) * dt, p.yaw + v.wz * dt)
            self.time += dt

    def estimate(self) -> Pose2:
        dx, dy, turn = self.rng.normal(0.0, (self.pose_sd[0], self.pose_sd[0], self.pose_sd[1]))
        return Pose2(self.pose.x + dx, self.pose.y + dy, self.pose.yaw + turn)

    def scan(self) -> NDArray[np.float64]:
        ranges = cast(self.scene, self.pose.x, self.pose.y, self.pose.yaw)
        seen = ranges < 10.0
        return np.where(seen, np.clip(ranges + self.rng.normal(0.0, self.lidar_sd, len(ranges)), 0.0, 9.999), 10.0)

    def drop(self, *obstacles: Obstacle) -> None:
        self.scene = dataclasses.replace(self.scene, obstacles=(*self.scene.obstacles, *obstacles))


@dataclass
class Record:
    """What one walk was like."""

    motion: Motion
    seconds: float
    clearance: float
    """Smallest true distance from the body to anything, m."""
    distance: float
    error: float
    """Distance from the true place to the goal at the end, m."""
    states: tuple[tuple[str, str], ...]
    """The (state, detail) pairs in the order they first followed each other."""


def walk(
    navigator: Navigator,
    walker: VelocityPlant,
    limit: float = 120.0,
    hook: Callable[[VelocityPlant, Motion], None] | None = None,
    period: float = 0.05,
) -> Record:
    """Run control at 20 Hz with a scan at 10 Hz until the goal's end, or `limit` seconds."""
    begun, least, distance = walker.time, math.inf, 0.0
    states: list[tuple[str, str]] = []
    motion: Motion | None = None
    for tick in _ticks(limit, period):
        scan = walker.scan() if tick % 2 == 0 else None
        motion = navigator.step(walker.time, walker.estimate(), walker.velocity, scan)
        if not states or states[-1] != (motion.state, motion.detail):
            states.append((motion.state, motion.detail))
        if hook is not None:
            hook(walker, motion)
        before = walker.pose
        walker.advance(Twist2(motion.vx, motion.vy, motion.wz), period)
        distance += math.hypot(walker.pose.x - before.x, walker.pose.y - before.y)
        least = min(least, body_clearance(walker.scene, walker.pose))
        if motion.state not in (State.FOLLOWING, State.WAITING, State.RECOVERING):
            break
    assert motion is not None
    goal = navigator.goal
    error = math.inf if goal is None else math.hypot(walker.pose.x - goal.x, walker.pose.y - goal.y)
    return Record(motion, walker.time - begun, least, distance, error, tuple(states))


def _ticks(limit: float, period: float) -> Iterator[int]:
    return iter(range(round(limit / period)))


def random_scene(seed: int, density: float, size: float = 20.0) -> Scene:
    """A walled square of `size` metres whose floor is covered by boxes and posts to about `density` (0..1)."""
    rng, half = np.random.default_rng(seed), size / 2
    obstacles: list[Obstacle] = [
        Box(0.0, -half - 0.05, size + 0.2, 0.1),
        Box(0.0, half + 0.05, size + 0.2, 0.1),
        Box(-half - 0.05, 0.0, 0.1, size + 0.2),
        Box(half + 0.05, 0.0, 0.1, size + 0.2),
    ]
    covered = 0.0
    while covered < density * size * size:
        a, b = (float(v) for v in rng.uniform(0.3, 2.0, 2))
        x, y = (float(v) for v in rng.uniform(-half, half, 2))
        if rng.random() < 0.3:
            obstacles.append(Cylinder(x, y, a / 2))
            covered += math.pi * a * a / 4
        else:
            obstacles.append(Box(x, y, a, b, yaw=float(rng.uniform(-3.0, 3.0))))
            covered += a * b
    return Scene("random", (-half, -half, half, half), tuple(obstacles), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
