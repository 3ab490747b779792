"""From pose to pose on a map: the cheapest way round obstacles, pulled straight, or the name of what is wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.planning.errors import GoalBlocked, InvalidPose, NavigationError, StartBlocked, Unreachable
from robot.planning.grid import Cell, Grid, block_mean
from robot.planning.inflation import Inflation
from robot.planning.path import Path, pull
from robot.planning.wavefront import Wavefront

_COARSE = 0.1
"""Cells of the first try, m."""
_ESCAPE = 0.5
"""How far from a spot that is too near to things (but free) a path may begin, m."""
_NEAREST, _STEP, _DIRECTIONS, _TRIED = 2.0, 0.05, 32, 5
"""How far from a goal where the body does not fit another is looked for, m, in what steps, m, in how many directions; and how many are planned."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What a plan leaves to each side of a body that walks straight on, m."""

    roomy: float = 0.09
    """At the first try; chosen: room to turn a little on the way."""
    tight: float = 0.01
    """Where that finds no way; chosen for the data sheet's outline, which holds 2 cm more to each side than the legs sweep."""


def check_finite(pose: Pose2, what: str) -> None:
    """Raise `InvalidPose` unless x, y and yaw are finite."""
    if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
        raise InvalidPose(f"the {what} ({pose.x}, {pose.y}, yaw {pose.yaw}) holds NaN or infinity")


class Planner:
    """Plans for the middle of a body with this footprint: on cells of about 10 cm with room to spare, else on the map's own cells
    without.
    """

    def __init__(self, grid: Grid, footprint: Footprint | None = None, margins: Margins | None = None) -> None:
        body, margins = footprint or Footprint(), margins or Margins()
        factor = max(1, round(_COARSE / grid.resolution))
        self.grid, self._body = grid, body
        self._levels = (
            _Level(grid, factor, Inflation.for_footprint(body, margins.roomy)),
            _Level(grid, 1, Inflation.for_footprint(body, margins.tight)),
        )

    def __repr__(self) -> str:
        return f"Planner({self.grid!r})"

    def plan(self, start: Pose2, goal: Pose2, extra: Floats | None = None) -> Path:
        """The cheapest path between two places; its ends are exactly theirs.

        `extra` is a clearance (m) per cell of the map for what the map does not know. Raises `InvalidPose`, `StartBlocked`,
        `GoalBlocked` or `Unreachable`.
        """
        check_finite(start, "start")
        check_finite(goal, "goal")
        roomy, tight = self._levels
        try:
            return roomy.plan(start, goal, extra)
        except (StartBlocked, GoalBlocked, Unreachable):
            return tight.plan(start, goal, extra)

    @property
    def tightest(self) -> float:
        """The least clearance of the body's middle with which a path is ever planned, m."""
        return self._levels[-1].inflation.inscribed

    def occupancy(self, clearance: Floats) -> NDArray[np.int8]:
        """What it costs to be at these clearances (m), 0 to 100, as in a message of a costmap."""
        return self._levels[-1].inflation.occupancy(clearance)

    def price(self, points: Floats, extra: Floats | None = None) -> float:
        """What walking along points (n, 2) not far apart costs, in metres of open floor; inf where it leads into something."""
        return self._levels[-1].price(points, extra)

    def check_on_map(self, goal: Pose2) -> None:
        """Raise `InvalidPose` or `GoalBlocked` when the goal is no place of the map at all."""
        check_finite(goal, "goal")
        if self.grid.cell(goal.x, goal.y) is None:
            raise GoalBlocked(f"the goal ({goal.x:.2f}, {goal.y:.2f}) lies outside of the map, {self.grid!r}")

    def check_goal(self, goal: Pose2) -> None:
        """Raise `InvalidPose` or `GoalBlocked` when the map alone rules the goal out: its middle, or the body's outline there."""
        check_finite(goal, "goal")
        self._levels[-1].check_goal(goal)
        px, py = self._body.placed(*(np.array(v) for v in (goal.x, goal.y, goal.yaw)))
        touching = self._clearances(px, py) < 0.0
        if touching.any():
            raise GoalBlocked(
                f"at the goal ({goal.x:.2f}, {goal.y:.2f}, yaw {goal.yaw:.2f}) the body would touch an obstacle"
                f" at ({px[touching][0]:.2f}, {py[touching][0]:.2f})"
            )

    def nearest_free(self, start: Pose2, goal: Pose2) -> Pose2 | None:
        """The place nearest to `goal` where the body fits with the goal's heading and to which a way leads; None if none is within 2 m."""
        reach = np.arange(_STEP, _NEAREST + _STEP / 2, _STEP)
        turns = np.linspace(0.0, 2 * math.pi, _DIRECTIONS, endpoint=False)
        x = (goal.x + reach[:, None] * np.cos(turns)).ravel()
        y = (goal.y + reach[:, None] * np.sin(turns)).ravel()
        px, py = self._body.placed(x, y, np.full_like(x, goal.yaw))
        fits = (self._clearances(px, py) > _STEP).all(axis=-1) & (self._clearances(x, y) > self.tightest + _STEP)
        for index in np.flatnonzero(fits)[:: max(1, int(fits.sum()) // _TRIED)]:
            there = Pose2(round(float(x[index]), 2), round(float(y[index]), 2), goal.yaw)
            try:
                self.check_goal(there)
                self.plan(start, there)
            except NavigationError:
                continue
            return there
        return None

    def _clearances(self, x: Floats, y: Floats) -> Floats:
        """Of the map at each point, m; outside of it there is as much as one likes, for a body may reach over its edge."""
        grid = self.grid
        columns = np.floor((x - grid.origin_x) / grid.resolution).astype(np.intp)
        rows = np.floor((y - grid.origin_y) / grid.resolution).astype(np.intp)
        inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
        known = grid.clearance[np.where(inside, rows, 0), np.where(inside, columns, 0)]
        return np.where(inside, known, math.inf)


class _Level:
    """Planning with one size of cell and one idea of how near is too near."""

    def __init__(self, grid: Grid, factor: int, inflation: Inflation) -> None:
        self.inflation = inflation
        self.factor = factor
        self.grid = grid.coarser(factor)

    @cached_property
    def _weights(self) -> Floats:
        return self.inflation.weights(self.grid.clearance)

    @cached_property
    def _static(self) -> Wavefront:
        return Wavefront(self._weights)

    def plan(self, start: Pose2, goal: Pose2, extra: Floats | None) -> Path:
        clearance, weights = self.grid.clearance, self._weights
        if extra is not None:
            clearance = np.minimum(clearance, block_mean(extra, self.factor, math.inf))
            weights = self.inflation.weights(clearance)
        last = self._goal_cell(goal, clearance)
        first = self._start_cell(start, clearance, weights)
        found = (self._static if extra is None else Wavefront(weights)).path(first, last)
        if found is None:
            raise Unreachable(
                f"no passage of {2 * self.inflation.inscribed:.2f} m or more joins ({start.x:.2f}, {start.y:.2f})"
                f" and ({goal.x:.2f}, {goal.y:.2f})"
            )
        inner = [self.grid.middle(*cell) for cell in pull(found[0], weights)[1:-1]]
        return Path(np.array([(start.x, start.y), *inner, (goal.x, goal.y)]))

    def price(self, points: Floats, extra: Floats | None) -> float:
        grid = self.grid
        clearance = grid.clearance if extra is None else np.minimum(grid.clearance, extra)
        columns, rows = ((points - (grid.origin_x, grid.origin_y)) / grid.resolution).astype(np.intp).T
        inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
        if len(points) < 2 or not inside.all():
            return 0.0 if inside.all() else math.inf
        weights = self.inflation.weights(clearance[rows, columns])
        steps = np.hypot(*np.diff(points, axis=0).T)
        return float((steps * (weights[1:] + weights[:-1]) / 2).sum())

    def check_goal(self, goal: Pose2) -> None:
        self._goal_cell(goal, self.grid.clearance)

    def _goal_cell(self, goal: Pose2, clearance: Floats) -> Cell:
        cell = self.grid.cell(goal.x, goal.y)
        if cell is None:
            raise GoalBlocked(f"the goal ({goal.x:.2f}, {goal.y:.2f}) lies outside of the map, {self.grid!r}")
        if clearance[cell] < self.inflation.inscribed:
            room = max(float(clearance[cell]), 0.0)
            raise GoalBlocked(
                f"the goal ({goal.x:.2f}, {goal.y:.2f}) has {room:.2f} m to the nearest obstacle;"
                f" the robot needs {self.inflation.inscribed:.2f} m"
            )
        return cell

    def _start_cell(self, start: Pose2, clearance: Floats, weights: Floats) -> Cell:
        """The start's cell or, where the robot stands too near to something, the nearest cell that is not."""
        cell = self.grid.cell(start.x, start.y)
        if cell is None:
            raise StartBlocked(f"the robot ({start.x:.2f}, {start.y:.2f}) stands outside of the map, {self.grid!r}")
        if np.isfinite(weights[cell]):
            return cell
        reach = math.ceil(_ESCAPE / self.grid.resolution)
        row, column = max(cell[0] - reach, 0), max(cell[1] - reach, 0)
        window = weights[row : cell[0] + reach + 1, column : cell[1] + reach + 1]
        near = np.argwhere(np.isfinite(window)) + np.array([row, column])
        if clearance[cell] <= 0.0 or not len(near):
            raise StartBlocked(
                f"the robot ({start.x:.2f}, {start.y:.2f}) stands in an obstacle,"
                f" or nothing is free within {_ESCAPE} m of it"
            )
        best = near[((near - cell) ** 2).sum(axis=1).argmin()]
        return int(best[0]), int(best[1])
