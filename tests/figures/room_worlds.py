"""Random rooms with things on the floor that no map shows: 5 cm to 2 m high, hanging low, holes, and a floor that lies lower.

The same seed gives the same room. A room is kept when a disc as wide as `PASSAGE` gets from its start to all of its goals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from math import exp, hypot, log, pi
from typing import Final

import numpy as np

from robot.geometry.planar import Pose2
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Cylinder, Obstacle, Pit, Scene
from tests.figures.jump_points import OctileSearch

PASSAGE: Final = 1.0
"""Width of the narrowest place on the widest way to a goal, at least, m: twice that of the body."""
_SIZE: Final = (10.0, 8.0)
"""Of a room, m."""
_WALL: Final = 0.1
_FURNITURE, _UNMAPPED, _HANGING, _HOLES = 4, 10, 2, 2
_LOWEST, _HIGHEST = 0.05, 2.0
"""Heights of what is not on the map, m."""
_GOALS: Final = 3
_APART: Final = 4.0
"""From one goal to the next, m."""
_FREE: Final = 0.9
"""About start and goals, m: room to turn in."""


@dataclass(frozen=True, slots=True)
class Room:
    """A scene, and the goals in it."""

    scene: Scene
    goals: tuple[Pose2, ...]


def room(seed: int) -> Room:
    """The room of this seed."""
    for attempt in count():
        random = np.random.default_rng([seed, attempt, 19])
        obstacles = (*_walls(), *_furniture(random), *_unmapped(random), *_hanging(random))
        pits = tuple(_pits(random))
        clearance = _clearance(obstacles, pits)
        poses = _poses(random, clearance)
        if len(poses) == _GOALS + 1 and _connected(clearance, poses):
            start = poses[0]
            scene = Scene(f"room {seed}", (0.0, 0.0, *_SIZE), obstacles, start, start, pits=pits)
            return Room(scene, tuple(poses[1:]))
    raise AssertionError("count() does not end")


def _walls() -> Iterator[Box]:
    length, width = _SIZE
    for y in (-_WALL / 2, width + _WALL / 2):
        yield Box(length / 2, y, length + 2 * _WALL, _WALL, height=2.0)
    for x in (-_WALL / 2, length + _WALL / 2):
        yield Box(x, width / 2, _WALL, width + 2 * _WALL, height=2.0)


def _place(random: np.random.Generator) -> tuple[float, float]:
    return float(random.uniform(0.3, _SIZE[0] - 0.3)), float(random.uniform(0.3, _SIZE[1] - 0.3))


def _furniture(random: np.random.Generator) -> Iterator[Box]:
    for _ in range(_FURNITURE):
        x, y = _place(random)
        length, width, turn = (float(v) for v in random.uniform((0.4, 0.4, -pi), (1.6, 1.6, pi)))
        yield Box(x, y, length, width, turn, float(random.uniform(0.7, 2.0)))


def _unmapped(random: np.random.Generator) -> Iterator[Obstacle]:
    """Things on the floor; as many of each factor of height."""
    for _ in range(_UNMAPPED):
        height = exp(random.uniform(log(_LOWEST), log(_HIGHEST)))
        x, y = _place(random)
        if random.random() < 0.3:
            yield Cylinder(x, y, float(random.uniform(0.04, 0.25)), height, mapped=False)
        else:
            length, width = random.uniform(0.08, 0.7, 2).tolist()
            yield Box(x, y, length, width, float(random.uniform(-pi, pi)), height, mapped=False)


def _hanging(random: np.random.Generator) -> Iterator[Box]:
    """Table tops and bars between knee and back."""
    for _ in range(_HANGING):
        bottom = float(random.uniform(0.3, 0.62))
        x, y = _place(random)
        length, width = random.uniform(0.1, 0.9, 2).tolist()
        yield Box(x, y, length, width, float(random.uniform(-pi, pi)), bottom + 0.1, bottom, mapped=False)


def _pits(random: np.random.Generator) -> Iterator[Pit]:
    """Two holes, and a lower floor along a part of the far wall."""
    taken: list[Pit] = []
    length = float(random.uniform(1.0, 2.5))
    lower = Pit(_SIZE[0] - length / 2, _SIZE[1] - 0.6, length, 1.2, float(random.uniform(0.15, 0.6)))
    yield lower
    taken.append(lower)
    while len(taken) <= _HOLES:
        x, y = _place(random)
        length, width = random.uniform(0.25, 0.9, 2).tolist()
        pit = Pit(x, y, length, width, float(random.uniform(0.15, 1.0)))
        if all(abs(x - o.x) > (pit.length + o.length) / 2 or abs(y - o.y) > (pit.width + o.width) / 2 for o in taken):
            yield pit
            taken.append(pit)


def _clearance(obstacles: tuple[Obstacle, ...], pits: tuple[Pit, ...]) -> Grid:
    """The room as one would map it who knows all of it."""
    solid = tuple(
        Box(o.x, o.y, o.length, o.width, o.yaw) if isinstance(o, Box) else Cylinder(o.x, o.y, o.radius)
        for o in obstacles
    ) + tuple(Box(pit.x, pit.y, pit.length, pit.width) for pit in pits)
    nowhere = Pose2(0.0, 0.0)
    return Grid.from_scene(Scene("all of it", (0.0, 0.0, *_SIZE), solid, nowhere, nowhere))


def _poses(random: np.random.Generator, grid: Grid) -> list[Pose2]:
    """The start and the goals; fewer when there is no room for them."""
    poses: list[Pose2] = []
    for _ in range(400):
        x, y = _place(random)
        cell = grid.cell(x, y)
        far = not poses or hypot(x - poses[-1].x, y - poses[-1].y) >= _APART
        if cell is not None and far and grid.clearance[cell] >= _FREE:
            poses.append(Pose2(x, y, float(random.uniform(-pi, pi))))
            if len(poses) == _GOALS + 1:
                break
    return poses


def _connected(grid: Grid, poses: list[Pose2]) -> bool:
    search = OctileSearch(grid.clearance >= PASSAGE / 2)
    cells = [cell for pose in poses if (cell := grid.cell(pose.x, pose.y)) is not None]
    try:
        for goal in cells[1:]:
            search.solve(cells[0], goal)
    except NavigationError:
        return False
    return True
