"""The named worlds. All coordinates of walls and shelves are multiples of 5 cm, so that a 5 cm map represents them
exactly.

The robot is 1.1 x 0.5 m, its legs sway, and it turns on a circle of 1.21 m: every aisle that leads anywhere is at least
1.8 m wide.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MappingProxyType

from actors.suggest import did_you_mean
from robot.geometry.planar import Pose2
from robot.scenes.dock import station
from robot.scenes.kitchen import kitchen
from robot.scenes.ramps import ramps
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene

_WALL = 0.1
_EAST, _NORTH, _WEST, _SOUTH = 0.0, math.pi / 2, math.pi, -math.pi / 2


class UnknownWorld(LookupError):
    """No world has this name; the message names the closest ones, or all."""


def _walls(bounds: tuple[float, float, float, float]) -> tuple[Box, ...]:
    """Four walls whose inner faces lie on the bounds, so the whole floor is free."""
    x0, y0, x1, y1 = bounds
    middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
    long_x, long_y = x1 - x0 + 2 * _WALL, y1 - y0 + 2 * _WALL
    return (
        Box(middle_x, y0 - _WALL / 2, long_x, _WALL, height=2.0),
        Box(middle_x, y1 + _WALL / 2, long_x, _WALL, height=2.0),
        Box(x0 - _WALL / 2, middle_y, _WALL, long_y, height=2.0),
        Box(x1 + _WALL / 2, middle_y, _WALL, long_y, height=2.0),
    )


def _warehouse() -> Scene:
    bounds = (-2.0, -3.2, 10.0, 7.2)
    rows = (-1.0, 2.1, 4.9)
    shelves = tuple(Box(x, y, length, 0.4, height=1.8) for y in rows for x, length in ((2.5, 2.6), (6.8, 2.2)))
    goods: tuple[Obstacle, ...] = (
        Box(-1.4, 1.8, 0.8, 0.8, height=0.6),
        Box(-1.5, 6.5, 0.6, 0.8, yaw=0.3, height=0.8),
        Cylinder(-1.6, 4.2, 0.2, height=2.5),
        Cylinder(9.85, 2.1, 0.15, height=2.5),
        Cylinder(9.7, 6.9, 0.15, height=2.5),
    )
    # 0.9 m from the shelf's face to the robot's middle: its half width plus 0.65 m, room enough to turn there.
    fronts = {f"shelf_{n}": Pose2(s.x, s.y + 1.1, _EAST) for n, s in enumerate(shelves, start=1)}
    places = fronts | {"start": Pose2(0.0, 0.0, _EAST), "dock": Pose2(-1.0, -2.2, _WEST)}
    return Scene(
        name="warehouse",
        bounds=bounds,
        obstacles=(*_walls(bounds), *shelves, *goods, station(places["dock"])),
        start=places["start"],
        dock=places["dock"],
        patrol=(
            Pose2(8.8, 0.5, _NORTH),
            Pose2(4.75, 3.5, _WEST),
            Pose2(8.8, 6.0, _WEST),
            Pose2(2.5, 6.0, _WEST),
            Pose2(-0.2, 2.9, _SOUTH),
            Pose2(4.75, -2.1, _WEST),
        ),
        places=MappingProxyType(places),
    )


def _empty() -> Scene:
    return Scene(
        name="empty",
        bounds=(-10.0, -10.0, 10.0, 10.0),
        obstacles=(),
        start=Pose2(0.0, 0.0),
        dock=Pose2(-8.0, 0.0, _WEST),
        patrol=(Pose2(5.0, 0.0), Pose2(5.0, 5.0, _NORTH), Pose2(0.0, 5.0, _WEST), Pose2(0.0, 0.0, _SOUTH)),
        places=MappingProxyType({"start": Pose2(0.0, 0.0), "dock": Pose2(-8.0, 0.0, _WEST)}),
    )


def _corridor() -> Scene:
    """A corridor of 2 m with one right-angled bend."""
    bounds = (-1.0, -1.0, 11.0, 9.0)
    filled, dock = Box(4.0, 5.0, 10.0, 8.0, height=2.0), Pose2(10.0, 8.0, _NORTH)
    return Scene(
        name="corridor",
        bounds=bounds,
        obstacles=(*_walls(bounds), filled, station(dock)),
        start=Pose2(0.0, 0.0, _EAST),
        dock=dock,
        patrol=(Pose2(5.0, 0.0, _EAST), Pose2(10.0, 4.0, _NORTH), Pose2(10.0, 8.0, _NORTH), Pose2(10.0, 0.5, _SOUTH)),
        places=MappingProxyType({"start": Pose2(0.0, 0.0), "bend": Pose2(10.0, 0.0, _NORTH)}),
    )


def _pillars() -> Scene:
    bounds, dock = (-2.0, -6.0, 10.0, 6.0), Pose2(-0.9, -4.8, _SOUTH)
    pillars = tuple(
        Cylinder(x, y + (1.2 if column % 2 else 0.0), 0.2, height=2.0)
        for column, x in enumerate((1.2, 3.6, 6.0, 8.4))
        for y in (-4.8, -2.4, 0.0, 2.4)
    )
    return Scene(
        name="pillars",
        bounds=bounds,
        obstacles=(*_walls(bounds), *pillars, station(dock)),
        start=Pose2(-0.8, 0.0, _EAST),
        dock=dock,
        patrol=(Pose2(4.8, 0.0, _EAST), Pose2(9.0, 4.8, _NORTH), Pose2(2.4, 4.8, _WEST), Pose2(4.8, -4.8, _SOUTH)),
        places=MappingProxyType({"start": Pose2(-0.8, 0.0), "middle": Pose2(4.8, 0.0)}),
    )


_BUILDERS: dict[str, Callable[[], Scene]] = {
    "warehouse": _warehouse,
    "empty": _empty,
    "corridor": _corridor,
    "pillars": _pillars,
    "kitchen": kitchen,
    "ramps": ramps,
}

WORLDS: tuple[str, ...] = tuple(_BUILDERS)
"""The names that `get_world` knows; the first is the default of the robot."""


def get_world(name: str = "warehouse") -> Scene:
    """The scene called `name`. Raises `UnknownWorld` with the closest names, or all."""
    builder = _BUILDERS.get(name)
    if builder is None:
        hint = did_you_mean(name, WORLDS, "did", most=3) or f"there are: {', '.join(WORLDS)}"
        raise UnknownWorld(f"there is no world called {name!r}; {hint}")
    return builder()
