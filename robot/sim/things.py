"""The small things of a scene that an arm moves about: where they are, which one a gripper would get, and where one comes to rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robot.geometry.planar import turned_back
from robot.geometry.vectors import Vector
from robot.model.arm import MOUNT, forward
from robot.planning.reach import GRASP_DISTANCE
from robot.scenes.scene import Box, Obstacle, Scene, Thing

STEP = 0.02
"""A thing that is let go comes to rest on a surface that is at most this much higher than its underside, m."""


def centre(thing: Thing) -> Vector:
    """The middle of a thing in the world, where a gripper takes it; m."""
    return np.array([thing.shape.x, thing.shape.y, thing.z + thing.shape.height / 2])


def tool_point(position: Vector, quaternion: Vector, angles: Vector) -> Vector:
    """Where the tool's tip is in the world, for a body at `position` (m) with attitude `quaternion` (body to world, w first)."""
    tip = forward(angles.tolist())
    inner = np.array([tip.x + MOUNT[0], tip.y + MOUNT[1], tip.z + MOUNT[2]])
    w, axis = float(quaternion[0]), quaternion[1:4]
    twice = 2.0 * np.cross(axis, inner)
    return np.asarray(position + inner + w * twice + np.cross(axis, twice), dtype=np.float64)


class Things:
    """The things of one scene, moved about without forces."""

    __slots__ = ("_now", "_obstacles")

    def __init__(self, scene: Scene) -> None:
        self._now = list(scene.things)
        self._obstacles = scene.obstacles

    def __len__(self) -> int:
        return len(self._now)

    def __getitem__(self, index: int) -> Thing:
        return self._now[index]

    @property
    def all(self) -> tuple[Thing, ...]:
        """All of them, where they are now."""
        return tuple(self._now)

    def near(self, tip: Vector) -> int | None:
        """The thing whose middle is nearest to `tip`, if it is near enough to be gripped."""
        distances = [float(np.linalg.norm(centre(thing) - tip)) for thing in self._now]
        best = min(range(len(distances)), key=distances.__getitem__, default=None)
        return best if best is not None and distances[best] <= GRASP_DISTANCE else None

    def put(self, index: int, middle: Vector) -> None:
        """Move a thing's middle to `middle`."""
        x, y, z = (float(value) for value in middle)
        thing = self._now[index]
        self._now[index] = replace(thing, shape=replace(thing.shape, x=x, y=y), z=z - thing.shape.height / 2)

    def drop(self, index: int) -> None:
        """Let a thing fall, upright, onto what is below it."""
        thing = self._now[index]
        below = [o.height for o in self._obstacles if o.height <= thing.z + STEP and _over(o, thing)]
        self._now[index] = replace(thing, z=max(below, default=0.0))


def _over(obstacle: Obstacle, thing: Thing) -> bool:
    """Whether the middle of a thing is over an obstacle, seen from above."""
    dx, dy = thing.shape.x - obstacle.x, thing.shape.y - obstacle.y
    if not isinstance(obstacle, Box):
        return dx * dx + dy * dy <= obstacle.radius**2
    along, across = turned_back(obstacle.yaw, dx, dy)
    return abs(along) <= obstacle.length / 2 and abs(across) <= obstacle.width / 2
