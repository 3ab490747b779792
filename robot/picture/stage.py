"""The world as solids. What is drawn stays inside the obstacle it stands for, so nothing looks free that is not."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import cos, sin

import numpy as np

from robot.geometry.vectors import Vector
from robot.picture import palette
from robot.picture.solids import Colour, Solid, box, stick
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene, Thing

POST = 0.05
At = Callable[[float, float, float], Vector]
"""From along, across and height of an obstacle to the world."""
LEVELS = (0.10, 0.66, 1.22)
"""Heights of a rack's boards, m."""
BEAM = 0.08
DADO = 0.7
CABINET = 0.6
"""Boxes up to this height are furniture where there are things to stand on them, m."""


def stage_solids(scene: Scene) -> list[Solid]:
    """Every obstacle of the scene, dressed as what it looks like: wall, rack, crate, pillar, or cabinet for what things stand on."""
    solids: list[Solid] = []
    for index, obstacle in enumerate(scene.obstacles):
        solids += _dressed(obstacle, scene, np.random.default_rng(index))
    return solids


def _dressed(obstacle: Obstacle, scene: Scene, rng: np.random.Generator) -> list[Solid]:
    if isinstance(obstacle, Cylinder):
        return _pillar(obstacle)
    axes = _axes(obstacle.yaw)
    if any(_carries(obstacle, thing) for thing in scene.things) or (obstacle.height <= CABINET and scene.things):
        return _cabinet(obstacle, axes)
    if obstacle.width <= 0.8 <= obstacle.length and obstacle.height > LEVELS[-1] + 0.3 and _inside(obstacle, scene):
        return _rack(obstacle, axes, rng)
    if obstacle.height <= 1.2 and max(obstacle.length, obstacle.width) <= 1.5:
        return _crate(obstacle, axes)
    return _wall(obstacle, axes)


def _inside(obstacle: Box, scene: Scene) -> bool:
    x0, y0, x1, y1 = scene.bounds
    return x0 < obstacle.x < x1 and y0 < obstacle.y < y1


def _axes(yaw: float) -> Vector:
    return np.array(((cos(yaw), -sin(yaw), 0.0), (sin(yaw), cos(yaw), 0.0), (0.0, 0.0, 1.0)))


def _wall(wall: Box, axes: Vector) -> list[Solid]:
    """Plaster above a darker dado."""
    dado = min(DADO, wall.height)
    parts = [(0.0, dado, palette.DADO), (dado, wall.height, palette.WALL)]
    return [
        box(np.array((wall.x, wall.y, (low + high) / 2.0)), axes, (wall.length, wall.width, high - low), colour)
        for low, high, colour in parts
        if high > low
    ]


def _pillar(pillar: Cylinder) -> list[Solid]:
    """Concrete, with a yellow collar at the height of a robot."""

    def ring(low: float, high: float, radius: float, colour: Colour) -> Solid:
        return stick(
            np.array((pillar.x, pillar.y, low)), np.array((pillar.x, pillar.y, high)), radius, colour, gloss=0.1
        )

    solids = [ring(0.0, pillar.height, 0.96 * pillar.radius, palette.PILLAR)]
    if pillar.height > 1.0:
        for number in range(5):
            colour = palette.BLACK if number % 2 else palette.HAZARD
            solids.append(ring(0.25 + 0.12 * number, 0.37 + 0.12 * number, pillar.radius, colour))
    return solids


def _crate(crate: Box, axes: Vector) -> list[Solid]:
    """A wooden crate on a pallet: a body and three boards around it."""
    base = np.array((crate.x, crate.y, 0.0))
    up = np.array((0.0, 0.0, 1.0))
    body = (crate.length - 0.06, crate.width - 0.06, crate.height - 0.12)
    solids = [box(base + up * (0.12 + body[2] / 2.0), axes, body, palette.CRATE, rounding=0.01)]
    for share in (0.0, 0.5, 1.0):
        z = 0.17 + share * (crate.height - 0.22)
        solids.append(box(base + up * z, axes, (crate.length, crate.width, 0.1), palette.BOARD, rounding=0.01))
    for offset in (-0.5, 0.0, 0.5):
        foot = base + axes[:, 1] * offset * (crate.width - 0.1) + up * 0.06
        solids.append(box(foot, axes, (crate.length, 0.1, 0.12), palette.BOARD, rounding=0.005))
    return solids


def _carries(box: Box, thing: Thing) -> bool:
    """Whether a thing stands on a box when the world begins."""
    near = max(abs(thing.shape.x - box.x) / box.length, abs(thing.shape.y - box.y) / box.width) <= 0.5
    return near and abs(thing.z - box.height) < 0.01


def _cabinet(cabinet: Box, axes: Vector) -> list[Solid]:
    """White sides on a plinth, below a wooden top."""
    base, up = np.array((cabinet.x, cabinet.y, 0.0)), np.array((0.0, 0.0, 1.0))
    length, width, top = cabinet.length, cabinet.width, 0.03
    middle = (length - 0.03, width - 0.03, cabinet.height - top - 0.04)
    plinth = (length - 0.06, width - 0.06, 0.04)
    return [
        box(base + up * 0.02, axes, plinth, palette.GRAPHITE),
        box(base + up * (0.04 + middle[2] / 2.0), axes, middle, palette.WHITE, rounding=0.004, gloss=0.2),
        box(
            base + up * (cabinet.height - top / 2.0),
            axes,
            (length, width, top),
            palette.BOARD,
            rounding=0.006,
            gloss=0.3,
        ),
    ]


def thing_solids(things: Iterable[Thing]) -> list[Solid]:
    """The small things, in their own colours, where they are."""
    solids: list[Solid] = []
    for thing in things:
        shape, colour = thing.shape, palette.linear("".join(f"{channel:02x}" for channel in thing.color))
        foot = np.array((shape.x, shape.y, thing.z))
        if isinstance(shape, Cylinder):
            top = foot + np.array((0.0, 0.0, shape.height))
            solids.append(stick(foot, top, shape.radius, colour, rounding=0.004, gloss=0.4))
        else:
            middle = foot + np.array((0.0, 0.0, shape.height / 2.0))
            size = (shape.length, shape.width, shape.height)
            solids.append(box(middle, _axes(shape.yaw), size, colour, rounding=0.004, gloss=0.4))
    return solids


def _rack(rack: Box, axes: Vector, rng: np.random.Generator) -> list[Solid]:
    """Blue posts, orange beams, boards, and cartons on them; the cartons are drawn from `rng`."""
    base = np.array((rack.x, rack.y, 0.0))

    def at(along: float, across: float, z: float) -> Vector:
        place: Vector = base + axes @ np.array((along, across, z))
        return place

    solids: list[Solid] = []
    bays = max(1, round(rack.length / 1.3))
    reach, depth = (rack.length - POST) / 2.0, (rack.width - POST) / 2.0
    for along in np.linspace(-reach, reach, bays + 1).tolist():
        for across in (-depth, depth):
            solids.append(
                box(at(along, across, rack.height / 2.0), axes, (POST, POST, rack.height), palette.FRAME, gloss=0.2)
            )
    for number, level in enumerate(LEVELS):
        solids.append(
            box(at(0.0, 0.0, level - 0.015), axes, (rack.length - 0.02, rack.width - 0.02, 0.03), palette.BOARD)
        )
        for across in (-depth, depth):
            beam = (rack.length - 0.01, 0.5 * POST, BEAM)
            solids.append(box(at(0.0, across * 1.04, level - BEAM / 2.0), axes, beam, palette.STEEL, gloss=0.2))
        room = (LEVELS[number + 1] - BEAM if number + 1 < len(LEVELS) else rack.height) - level
        for bay in range(bays):
            start = -reach + 2.0 * reach * bay / bays + POST / 2.0 + 0.03
            end = -reach + 2.0 * reach * (bay + 1) / bays - POST / 2.0 - 0.03
            solids += _cartons(start, end, level, room, rack.width - 0.06, axes, at, rng)
    return solids


def _cartons(
    start: float, end: float, level: float, room: float, depth: float, axes: Vector, at: At, rng: np.random.Generator
) -> list[Solid]:
    """A row of cartons from `start` to `end` along a board, some stacked, with gaps."""
    solids: list[Solid] = []
    along = start + rng.uniform(0.0, 0.08)
    while along + 0.2 < end:
        size = float(min(rng.uniform(0.24, 0.44), end - along))
        height = float(rng.uniform(0.5, 0.9) * room)
        colour = palette.CARTONS[int(rng.integers(len(palette.CARTONS)))]
        if rng.uniform() > 0.1:
            back = float(rng.uniform(0.0, 0.04))
            carton = (size, depth - 2.0 * back, height)
            solids.append(box(at(along + size / 2.0, 0.0, level + height / 2.0), axes, carton, colour, rounding=0.006))
        along += size + float(rng.uniform(0.02, 0.07))
    return solids
