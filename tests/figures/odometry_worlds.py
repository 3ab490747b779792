"""Halls with things to see, for walks without a map, and courses through them. Drawn from a seed; nothing in the robot was chosen on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import cos, hypot, pi, sin
from typing import Final, TypeAlias

import numpy as np

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene
from tests.figures.walk_measures import YARD, Command, Place, in_yard, low_boxes

Course: TypeAlias = Callable[[Place], Command]
"""From the true pose to the next command."""

WALL: Final = 0.1
"""Thickness, m."""
FROM_WALL: Final = 1.0
"""Things stand so far from the walls at least, m: their middles."""
ROOM: Final = 0.9
"""Between the robot's middle and whatever stands there, m, on the way that a course looks ahead."""
TRIES: Final = 80
"""Commands that are drawn, until the way of one is free; else the freest is taken. The second half of them are slow and turn twice as fast."""
STEP: Final = 0.2
"""In which a course looks ahead, s."""


@dataclass(frozen=True, slots=True)
class Hall:
    """A scene, a course through it, and for how long each of the course's commands holds."""

    scene: Scene
    course: Course
    stretch: float
    """s."""


def flat_hall(seed: int) -> Hall:
    """A hall of 28 x 20 m with 36 things and a level floor; the course winds between them at 0.4 to 1 m/s."""
    things = _things(np.random.default_rng([seed, 63]), (28.0, 20.0), 36, around=2.5, apart=3.0)
    random = np.random.default_rng([seed, 5])

    def course(pose: Place) -> Command:
        freest, best = -1.0, (0.0, 0.0, 0.0)
        for attempt in range(TRIES):
            speed, turn = (1.0, 0.4) if attempt < TRIES / 2 else (0.5, 0.8)
            command = (random.uniform(0.4, speed), random.uniform(-0.1, 0.1), random.uniform(-turn, turn))
            free = _free(pose, command, things, (14.0, 10.0))
            if free > freest:
                freest, best = free, command
            if free > ROOM:
                break
        return best

    return Hall(_scene("hall", things, (28.0, 20.0)), course, 4.0)


def rough_hall(seed: int) -> Hall:
    """A hall of 18 x 14 m with 14 things around a yard of low boxes, up to 5 cm; the course stays in the yard, at 0.4 to 0.6 m/s."""
    things = _things(np.random.default_rng([seed, 62]), (18.0, 14.0), 14, around=YARD + 1.6, apart=0.0)
    random = np.random.default_rng([seed, 61])
    scene = _scene("rough hall", (*low_boxes(random), *things), (18.0, 14.0))
    return Hall(scene, partial(in_yard, random), 1.0)


def _things(
    random: np.random.Generator, size: tuple[float, float], count: int, *, around: float, apart: float
) -> tuple[Obstacle, ...]:
    """Boxes and every third time a cylinder, the middles at least `around` from the robot's start and `apart` from each other, m."""
    x, y = size[0] / 2 - FROM_WALL, size[1] / 2 - FROM_WALL
    things: list[Obstacle] = []
    while len(things) < count:
        at = random.uniform(-x, x), random.uniform(-y, y)
        if hypot(*at) < around or any(hypot(at[0] - one.x, at[1] - one.y) < apart for one in things):
            continue
        if len(things) % 3 == 2:
            things.append(Cylinder(*at, random.uniform(0.15, 0.4), height=1.5))
        else:
            long, wide = random.uniform(0.4, 1.5), random.uniform(0.3, 0.8)
            things.append(Box(*at, long, wide, yaw=random.uniform(-pi, pi), height=1.5))
    return tuple(things)


def _scene(name: str, obstacles: tuple[Obstacle, ...], size: tuple[float, float]) -> Scene:
    x, y = size[0] / 2, size[1] / 2
    walls = (
        *(Box(0.0, side * (y + WALL / 2), 2 * x + 2 * WALL, WALL, height=2.0) for side in (-1, 1)),
        *(Box(side * (x + WALL / 2), 0.0, WALL, 2 * y, height=2.0) for side in (-1, 1)),
    )
    return Scene(name, (-x, -y, x, y), (*obstacles, *walls), Pose2(0.0, 0.0), Pose2(0.0, 0.0))


def _free(pose: Place, command: Command, things: tuple[Obstacle, ...], half: tuple[float, float]) -> float:
    """Least distance (m) of the robot's middle from things and walls while a command holds for 4 s, and 2 s straight on from there."""
    (x, y, yaw), (vx, vy, wz) = pose, command
    free = float("inf")
    for step in range(30):
        x += STEP * (vx * cos(yaw) - vy * sin(yaw))
        y += STEP * (vx * sin(yaw) + vy * cos(yaw))
        yaw += STEP * wz if step < 20 else 0.0
        free = min(
            free, half[0] - abs(x), half[1] - abs(y), *(hypot(x - one.x, y - one.y) - _radius(one) for one in things)
        )
    return free


def _radius(thing: Obstacle) -> float:
    return thing.radius if isinstance(thing, Cylinder) else 0.5 * hypot(thing.length, thing.width)
