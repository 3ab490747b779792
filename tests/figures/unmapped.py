"""Going somewhere without a map: an empty grid around start and goal, in whatever frame the pose is given, to be filled by the LiDAR."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.navigation.limits import Limits, Tolerance
from robot.navigation.navigator import Navigator
from robot.navigation.navigator_config import NavigatorConfig
from robot.planning.grid import Grid
from robot.planning.planner import Margins

_MARGIN = 5.0
"""Floor that may be used beyond start and goal, m."""
_WELL_WITHIN = 0.9
"""Share of the wanted radius at which the robot counts itself as there; chosen: its estimate is off by a few centimetres."""
_RESOLUTION = 0.05
"""m."""
_FAST = Limits(vx_min=-0.5, vx_max=1.5, wz_max=1.3, acceleration=1.5, creep=0.6, eagerness=5.0)
"""Chosen on the 30 BARN worlds."""


@dataclass(frozen=True, slots=True)
class Tuning:
    """The body's outline with the margins that go with it, and the numbers of navigation."""

    footprint: Footprint
    margins: Margins
    limits: Limits = _FAST
    config: NavigatorConfig = field(default_factory=NavigatorConfig)


WALKING = Tuning(Footprint(length=1.10, width=0.46, ahead=-0.08), Margins(roomy=0.11, tight=0.03))
"""What trunk and legs of the walking robot sweep at up to 1.6 m/s: 0.47 m ahead, 0.63 m behind (the knees), 0.23 m to each side.

That outline holds no slack; measured: with the usual margins, 2 cm less, one of 30 BARN runs in physics touched a post.
"""
SHEET = Tuning(Footprint(), Margins())
"""The data sheet's rectangle: the outline of the body that has no legs to sweep with."""


def unmapped_grid(start: Pose2, goal: Pose2) -> Grid:
    """All free, and large enough to walk round things between the two."""
    x0, x1 = min(start.x, goal.x) - _MARGIN, max(start.x, goal.x) + _MARGIN
    y0, y1 = min(start.y, goal.y) - _MARGIN, max(start.y, goal.y) + _MARGIN
    shape = (round((y1 - y0) / _RESOLUTION), round((x1 - x0) / _RESOLUTION))
    return Grid(np.zeros(shape, dtype=np.bool_), _RESOLUTION, x0, y0)


def unmapped_navigator(start: Pose2, goal: Pose2, radius: float, tuning: Tuning = WALKING) -> Navigator:
    """A navigator that knows nothing but where it is and where it shall go: to within `radius` (m), in any heading."""
    tolerance = Tolerance(position=_WELL_WITHIN * radius, yaw=2 * math.pi)
    grid = unmapped_grid(start, goal)
    return Navigator(grid, tuning.limits, tolerance, tuning.footprint, tuning.margins, tuning.config)
