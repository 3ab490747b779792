"""Occupancy grid: which cells of the floor are free, and how far the nearest obstacle is.

Frame and indices, as in ``nav_msgs/OccupancyGrid``: arrays have shape (height, width) and are indexed ``[row,
column]``; column grows with x, row grows with y, so row 0 is the lowest y. ``(origin_x, origin_y)`` is the outer corner
of cell (0, 0), and the middle of cell (row, column) lies at ``origin + ((column + 0.5) * resolution, (row + 0.5) *
resolution)``. A flat message array is row-major: cell (row, column) is ``data[row * width + column]``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robot.geometry.planar import turned_back
from robot.geometry.vectors import Floats
from robot.planning.errors import InvalidPose
from robot.planning.ground import ground_of, rises_to_lidar
from robot.scenes.scene import Box, Obstacle, Scene

Cell = tuple[int, int]
"""Row and column."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Values of an OccupancyGrid message's cells."""

_LETHAL_AT = 65
"""Occupancy (percent) from which a cell counts as an obstacle: nav2's map server default."""
_CELL, _RIM = 0.05, 0.2
"""Of the map of a scene: side of a cell, nav2's default, and width of the solid rim about the floor, four cells; m."""
_REACH = 3.0
"""Up to here distances are exact unless more is asked for, m; chosen: beyond it nothing matters to a body of one metre."""
_FARTHEST = 1e3
"""Bounds clearances before they are averaged, m: a map without obstacles has infinite ones."""


def signed_distance(obstacle: Obstacle, x: Floats, y: Floats) -> Floats:
    """Exact distance (m) from each point to the obstacle's outline, negative inside."""
    rel_x, rel_y = x - obstacle.x, y - obstacle.y
    if not isinstance(obstacle, Box):
        return np.asarray(np.hypot(rel_x, rel_y) - obstacle.radius, dtype=np.float64)
    along, across = turned_back(obstacle.yaw, rel_x, rel_y)
    out_x, out_y = np.abs(along) - obstacle.length / 2, np.abs(across) - obstacle.width / 2
    outside = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(out_x, out_y), 0.0), dtype=np.float64)


def distance_to(occupied: NDArray[np.bool_], resolution: float, reach: float = _REACH) -> Floats:
    """Distance (m) from each cell's middle to the faces of the occupied cells, negative inside.

    Exact between middles (the half cell from a middle to a face is taken off) up to `reach` metres either way, of cells below 1.6 cm up to 1 m; what
    lies farther says at least that.
    """
    cells = max(min(math.ceil(reach / resolution), max(_MOST_CELLS, math.ceil(_NEEDED / resolution))), 1)
    distance = (_distances(occupied, cells) - 0.5) * resolution
    rows, columns = np.flatnonzero(occupied.any(axis=1)), np.flatnonzero(occupied.any(axis=0))
    if len(rows):
        # Of the free cells, those just outside of the rectangle about all that is occupied are nearer to it than any farther out.
        part = slice(max(rows[0] - 1, 0), rows[-1] + 2), slice(max(columns[0] - 1, 0), columns[-1] + 2)
        solid = occupied[part]
        distance[part] = np.where(solid, (0.5 - _distances(~solid, cells)) * resolution, distance[part])
    return distance


_MOST_CELLS = 180
"""The square of this and that of one more fit into 16 bits together."""
_NEEDED = 1.0
"""Within this distances are exact, however small the cells are, m; chosen: a body that turns on the spot with room to spare needs 0.85 m."""


def _distances(targets: NDArray[np.bool_], most: int) -> Floats:
    """Distance in cells to the nearest target, exact up to `most` (Felzenszwalb and Huttenlocher's separable squares, 2012).

    First along columns by running extremes, then across them by trying every offset: for the few dozen cells that matter this
    is as fast as scipy's unbounded transform, whose import alone takes 0.3 s or more.
    """
    height, width = targets.shape
    far = most + 1
    row = np.arange(height, dtype=np.int32)[:, None]
    above = np.maximum.accumulate(np.where(targets, row, -far), axis=0)
    below = np.minimum.accumulate(np.where(targets, row, height + far)[::-1], axis=0)[::-1]
    kind: Any = np.uint16 if most <= _MOST_CELLS else np.int32
    along: NDArray[Any] = np.minimum(np.minimum(row - above, below - row), far).astype(kind)
    squares = along * along
    best, shifted = squares.copy(), np.empty_like(squares)
    for offset in range(1, min(most, width - 1) + 1):
        np.add(squares, kind(offset * offset), out=shifted)
        np.minimum(best[:, offset:], shifted[:, :-offset], out=best[:, offset:])
        np.minimum(best[:, :-offset], shifted[:, offset:], out=best[:, :-offset])
    return np.asarray(np.sqrt(np.minimum(best, kind(far * far)), dtype=np.float64), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Grid:
    """A map of the floor in cells. Values: nothing in it changes after construction.

    Everything outside of it counts as an obstacle for planning; the clearance speaks only of the cells inside.
    """

    occupied: NDArray[np.bool_]
    """Shape (height, width), read-only."""
    resolution: float
    """Side of a cell, metres."""
    origin_x: float = 0.0
    origin_y: float = 0.0
    exact_clearance: Floats | None = field(default=None, repr=False)
    """Clearance known better than from the cells, same shape; `from_scene` fills it."""
    ground: Floats | None = field(default=None, repr=False)
    """Height (m) of what is walked on, same shape; None where it is level floor all over."""

    def __post_init__(self) -> None:
        if self.occupied.ndim != 2 or self.occupied.size == 0:
            raise ValueError(f"a grid needs a 2-D array with at least one cell, not shape {self.occupied.shape}")
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"the resolution of a grid must be positive metres per cell, not {self.resolution}")
        self.occupied.setflags(write=False)

    def __repr__(self) -> str:
        x0, y0, x1, y1 = self.bounds
        share = float(self.occupied.mean())
        return (
            f"Grid({self.width} x {self.height} cells of {self.resolution:g} m, x {x0:g}..{x1:g}, y {y0:g}..{y1:g},"
            f" {share:.0%} occupied)"
        )

    # --- making one -------------------------------------------------------------------------------------------------

    @classmethod
    def from_scene(cls, scene: Scene, resolution: float = _CELL, margin: float = _RIM) -> Self:
        """The map of a scene's floor, with what is mapped on it and a rim of `margin` metres, so that the walls on its edge are on the map.

        A cell is occupied when its middle lies in an obstacle, outside of the floor, or on ground that cannot be walked on; the clearance
        from obstacles is exact. The rim is solid: behind a thin wall the distance to its far face would draw scan matching through it.
        """
        x0, y0, x1, y1 = (edge + side * margin for edge, side in zip(scene.bounds, (-1, -1, 1, 1), strict=True))
        width, height = (max(1, round((b - a) / resolution)) for a, b in ((x0, x1), (y0, y1)))
        columns: Floats = x0 + (np.arange(width, dtype=np.float64) + 0.5) * resolution
        rows: Floats = y0 + (np.arange(height, dtype=np.float64) + 0.5) * resolution
        x, y = np.broadcast_arrays(columns, rows[:, None])
        low_x, low_y, high_x, high_y = scene.bounds
        clearance = np.minimum.reduce([x - low_x, high_x - x, y - low_y, high_y - y])
        for obstacle in (one for one in scene.obstacles if one.mapped):
            np.minimum(clearance, signed_distance(obstacle, x, y), out=clearance)
        ground: Floats | None = None
        if scene.terrain:
            ground, blocked = ground_of(scene.terrain, x, y, clearance > 0.0)
            if blocked.any():
                np.minimum(clearance, distance_to(blocked, resolution), out=clearance)
        clearance.setflags(write=False)
        return cls(clearance <= 0.0, resolution, x0, y0, exact_clearance=clearance, ground=ground)

    @classmethod
    def from_occupancy(
        cls, data: ArrayLike, width: int, height: int, resolution: float, origin_x: float = 0.0, origin_y: float = 0.0
    ) -> Self:
        """From the fields of an OccupancyGrid message. Unknown cells (-1) count as obstacles, as do cells of 65 % and
        more.
        """
        cells = np.asarray(data)
        if cells.size != width * height:
            raise ValueError(f"the map says {width} x {height} cells, but its data holds {cells.size} values")
        values = cells.reshape(height, width).astype(np.int16)
        return cls((values < 0) | (values >= _LETHAL_AT), resolution, origin_x, origin_y)

    def to_occupancy(self) -> NDArray[np.int8]:
        """Flat row-major int8 array for an OccupancyGrid message: 0 free, 100 occupied."""
        return np.where(self.occupied, OCCUPIED, FREE).astype(np.int8).reshape(-1)

    # --- asking it --------------------------------------------------------------------------------------------------

    @property
    def width(self) -> int:
        return int(self.occupied.shape[1])

    @property
    def height(self) -> int:
        return int(self.occupied.shape[0])

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max in metres."""
        x, y, r = self.origin_x, self.origin_y, self.resolution
        return x, y, x + self.width * r, y + self.height * r

    @cached_property
    def clearance(self) -> Floats:
        """Distance (m) from each cell's middle to the nearest obstacle, negative inside, inf without obstacles; read-
        only.
        """
        field_ = distance_to(self.occupied, self.resolution) if self.exact_clearance is None else self.exact_clearance
        field_.setflags(write=False)
        return field_

    def cell(self, x: float, y: float) -> tuple[int, int] | None:
        """(row, column) of the cell that holds the point, or None outside of the map. Raises `InvalidPose` for NaN and
        inf.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InvalidPose(f"({x}, {y}) is not a point: coordinates must be finite numbers")
        column = math.floor((x - self.origin_x) / self.resolution)
        row = math.floor((y - self.origin_y) / self.resolution)
        return (row, column) if 0 <= row < self.height and 0 <= column < self.width else None

    def is_ground(self, x: float, y: float, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which cells hold ground so high that it returns the beams of the LiDAR of a robot at (x, y)."""
        here = self.cell(x, y)
        if self.ground is None or here is None:
            return np.zeros(rows.shape, dtype=np.bool_)
        return rises_to_lidar(self.ground[rows, columns], float(self.ground[here]))

    def middle(self, row: int, column: int) -> tuple[float, float]:
        """The point (x, y) in the middle of a cell, metres."""
        return self.origin_x + (column + 0.5) * self.resolution, self.origin_y + (row + 0.5) * self.resolution

    def coarser(self, factor: int) -> Grid:
        """The same floor in cells `factor` times as large; each has the mean clearance of its parts, which is that of
        its middle.
        """
        if factor == 1:
            return self
        clearance = block_mean(np.minimum(self.clearance, _FARTHEST), factor, -self.resolution)
        return Grid(clearance <= 0.0, self.resolution * factor, self.origin_x, self.origin_y, exact_clearance=clearance)


def block_mean(field: Floats, factor: int, outside: float) -> Floats:
    """Means over blocks of factor x factor cells; `outside` fills what the last blocks lack."""
    if factor == 1:
        return field
    height, width = field.shape
    rows, columns = -(-height // factor), -(-width // factor)
    padded = np.pad(field, ((0, rows * factor - height), (0, columns * factor - width)), constant_values=outside)
    return np.asarray(padded.reshape(rows, factor, columns, factor).mean(axis=(1, 3)), dtype=np.float64)
