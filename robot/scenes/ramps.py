"""A corridor that a hill stands across: a ramp up, a landing, and a ramp down, over which lies the only way to the goals behind it."""

from __future__ import annotations

from math import pi, radians, tan
from types import MappingProxyType

from robot.geometry.planar import Pose2
from robot.scenes.dock import station
from robot.scenes.scene import Box, Scene
from robot.scenes.terrain import Ramp

_WALL, _TALL = 0.1, 3.0
"""Of the walls, m: tall enough to be seen from the top of the hill."""
_BEFORE = 3.0
"""From the start to the hill, and from the hill to the goal behind it, m."""
_END, _DOCK = 1.5, -2.0
"""From that goal to the wall behind it; and where the dock is, behind the start, m."""


def ramps(degrees: float = 15.0, *, height: float = 0.8, landing: float = 2.0, width: float = 2.4) -> Scene:
    """The world. `degrees` is the slope of both ramps, `height` that of the landing; m. Raises `ValueError` for a slope that is none."""
    if not 0.0 < degrees < 60.0:
        raise ValueError(f"a ramp of {degrees:g} degrees cannot be: give more than 0 and less than 60")
    run = height / tan(radians(degrees))
    top, behind = _BEFORE + run + landing / 2, 2 * _BEFORE + 2 * run + landing
    dock = Pose2(_DOCK, 0.0, pi)
    bounds = (_DOCK - _END, -width / 2, behind + _END, width / 2)
    terrain = (
        Ramp(_BEFORE + run / 2, 0.0, run, width, height),
        Ramp(top, 0.0, landing, width, height, bottom=height),
        Ramp(behind - _BEFORE - run / 2, 0.0, run, width, height, yaw=pi),
    )
    start, goal = Pose2(0.0, 0.0), Pose2(behind, 0.0)
    return Scene(
        name="ramps",
        bounds=bounds,
        obstacles=(*_walls(bounds), station(dock)),
        start=start,
        dock=dock,
        patrol=(goal, Pose2(top, 0.0, pi), Pose2(0.0, 0.0, pi), Pose2(top, 0.0)),
        places=MappingProxyType({"start": start, "top": Pose2(top, 0.0), "behind": goal}),
        terrain=terrain,
    )


def _walls(bounds: tuple[float, float, float, float]) -> tuple[Box, ...]:
    x0, y0, x1, y1 = bounds
    length, width, middle = x1 - x0 + 2 * _WALL, y1 - y0, (x0 + x1) / 2
    return (
        Box(middle, y0 - _WALL / 2, length, _WALL, height=_TALL),
        Box(middle, y1 + _WALL / 2, length, _WALL, height=_TALL),
        Box(x0 - _WALL / 2, 0.0, _WALL, width, height=_TALL),
        Box(x1 + _WALL / 2, 0.0, _WALL, width, height=_TALL),
    )
